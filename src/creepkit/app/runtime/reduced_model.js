// A reduced-order model of an axisymmetric body: displacements as a sum of modes, integrals over few weighted points
// (the core's reduced_order_model.hpp). Its arrays come packed from creepkit.app.model_data.rom_data.
"use strict";

(function (creepkit) {
  const { setStrains, NUMBERS } = creepkit.kinematics;

  /** The leading `count` of the values of all modes, the last axis of `from`. */
  function leading(from, all, count) {
    if (count === all) return from;
    return Float64Array.from({ length: (from.length / all) * count }, (_, i) => from[Math.floor(i / count) * all + (i % count)]);
  }

  /** Arrays of a packed model with so many modes, by default all of them. */
  function unpackModel(data, count = data.modes) {
    const all = data.modes, modes = Math.min(count, all), { nodeCount } = data;
    const shapes = creepkit.decode(data.arrays.modes.data, data.arrays.modes.type); // (modes, nodes, 2)
    const array = (name) => creepkit.decode(data.arrays[name].data, data.arrays[name].type);
    const displacement = (node, axis) => Float64Array.from({ length: modes }, (_, i) => shapes[(i * nodeCount + node) * 2 + axis]);
    const top = array("top"), pressed = array("pressed"), places = array("places");
    const observed = top.map((node) => displacement(node, 1));
    const measured = [...observed, ...[...new Set(pressed)].flatMap((node) => [displacement(node, 0), displacement(node, 1)])];
    return {
      modes, nodeCount, top, places, observed, measured, displacement,
      points: data.points,
      edges: triples(array("edges")),
      gradients: leading(array("gradients"), all, modes), // (points, 5, modes)
      weights: array("weights"),
      sides: sidePoints(places, pressed, displacement, modes),
      observation: { window: data.window, nodes: array("sampling"), grid: grid(array) },
    };
  }

  function triples(numbers) {
    return Array.from({ length: numbers.length / 3 }, (_, k) => Array.from(numbers.slice(3 * k, 3 * k + 3)));
  }

  /** Where profiles are sampled for the fit of a generalised Gaussian. */
  function grid(array) {
    const logCosine = array("log_cosine"), logSine = array("log_sine"), weights = array("angular");
    const angles = Array.from(weights, (weight, k) => ({ weight, logCosine: logCosine[k], logSine: logSine[k] }));
    return { logRadius: array("log_radius"), weights: array("radial"), angles };
  }

  /** Gauss points of the sides under pressure: weight, r, dr/dx, dz/dx at rest and the modes' changes of them. */
  function sidePoints(places, pressed, displacement, modes) {
    const place = Math.sqrt(0.6), result = [];
    for (let side = 0; side < pressed.length; side += 3) {
      const nodes = pressed.slice(side, side + 3);
      [[-place, 5 / 9], [0, 8 / 9], [place, 5 / 9]].forEach(([x, weight]) => {
        const values = [0.5 * x * (x - 1), 1 - x * x, 0.5 * x * (x + 1)], slopes = [x - 0.5, -2 * x, x + 0.5];
        const rest = (shape, axis) => shape.reduce((total, share, j) => total + share * places[2 * nodes[j] + axis], 0);
        const moved = (shape, axis) => {
          const sum = new Float64Array(modes);
          shape.forEach((share, j) => displacement(nodes[j], axis).forEach((u, i) => (sum[i] += share * u)));
          return sum;
        };
        result.push({
          weight, radius: rest(values, 0), dr: rest(slopes, 0), dz: rest(slopes, 1),
          byRadius: moved(values, 0), byHeight: moved(values, 1), byDr: moved(slopes, 0), byDz: moved(slopes, 1),
        });
      });
    }
    return result;
  }

  /** The balance of forces of a model in the space of its modes, with the points of one law. */
  class ReducedBody {
    constructor(model, law) {
      this.model = model;
      this.points = new creepkit.BodyPoints(law, model.points);
      this.F = new Float64Array(5);
      this.at = new Float64Array(NUMBERS);
      this.P = new Float64Array(5);
      this.A = new Float64Array(25);
      this.products = new Float64Array(5 * model.modes);
      this.across = new Float64Array(model.modes);
      this.along = new Float64Array(model.modes);
      this.tangent = new Float64Array(model.modes * model.modes);
      this.residual = new Float64Array(model.modes);
    }

    deform(k, q) {
      const { F, model } = this, { modes, gradients } = model;
      let f11 = 1.0, f12 = 0.0, f21 = 0.0, f22 = 1.0, f33 = 1.0;
      for (let i = 0, g = 5 * k * modes; i < modes; i += 1, g += 1) {
        const factor = q[i];
        f11 += factor * gradients[g];
        f12 += factor * gradients[g + modes];
        f21 += factor * gradients[g + 2 * modes];
        f22 += factor * gradients[g + 3 * modes];
        f33 += factor * gradients[g + 4 * modes];
      }
      F[0] = f11;
      F[1] = f12;
      F[2] = f21;
      F[3] = f22;
      F[4] = f33;
    }

    /** Out-of-balance forces and, if `stiff`, the tangent's lower triangle; false where a point fails. */
    assemble(stage, q, stiff, tolerance) {
      const { model, points, F, at, P, A, residual, tangent } = this, { modes, gradients, weights } = model;
      residual.fill(0.0);
      if (stiff) tangent.fill(0.0);
      points.undefinedRate = false;
      for (let k = 0; k < model.points; k += 1) {
        this.deform(k, q);
        if (!setStrains(F, at)) return false;
        if (!points.update(stage, k, F, at, stiff, tolerance, P, A)) return false;
        const weight = weights[k];
        this.addForces(k, weight);
        if (stiff) this.addStiffness(5 * k * modes, weight, gradients, modes);
      }
      this.press(stage.pressure, q, stiff);
      return true;
    }

    addForces(k, weight) {
      const { P, residual, model } = this, { modes, gradients } = model;
      const p0 = weight * P[0], p1 = weight * P[1], p2 = weight * P[2], p3 = weight * P[3], p4 = weight * P[4];
      for (let i = 0, g = 5 * k * modes; i < modes; i += 1, g += 1) {
        residual[i] += p0 * gradients[g] + p1 * gradients[g + modes] + p2 * gradients[g + 2 * modes] +
          p3 * gradients[g + 3 * modes] + p4 * gradients[g + 4 * modes];
      }
    }

    addStiffness(start, weight, gradients, modes) {
      const { A, products, tangent } = this;
      for (let s = 0; s < 5; s += 1) {
        const a0 = weight * A[5 * s], a1 = weight * A[5 * s + 1], a2 = weight * A[5 * s + 2];
        const a3 = weight * A[5 * s + 3], a4 = weight * A[5 * s + 4];
        for (let i = 0; i < modes; i += 1) {
          const g = start + i;
          products[s * modes + i] = a0 * gradients[g] + a1 * gradients[g + modes] + a2 * gradients[g + 2 * modes] +
            a3 * gradients[g + 3 * modes] + a4 * gradients[g + 4 * modes];
        }
      }
      // two rows at a time: what is read of the products serves both
      for (let i = 0; i < modes; i += 2) {
        const two = i + 1 < modes, g = start + i, h = two ? g + 1 : g, row = i * modes, next = row + modes;
        const g0 = gradients[g], g1 = gradients[g + modes], g2 = gradients[g + 2 * modes];
        const g3 = gradients[g + 3 * modes], g4 = gradients[g + 4 * modes];
        const h0 = gradients[h], h1 = gradients[h + modes], h2 = gradients[h + 2 * modes];
        const h3 = gradients[h + 3 * modes], h4 = gradients[h + 4 * modes];
        const last = two ? i + 1 : i;
        for (let j = 0; j <= last; j += 1) {
          const p0 = products[j], p1 = products[modes + j], p2 = products[2 * modes + j];
          const p3 = products[3 * modes + j], p4 = products[4 * modes + j];
          tangent[row + j] += g0 * p0 + g1 * p1 + g2 * p2 + g3 * p3 + g4 * p4;
          if (two) tangent[next + j] += h0 * p0 + h1 * p1 + h2 * p2 + h3 * p3 + h4 * p4;
        }
      }
    }

    /** Take the pressure's force off the internal one, and its symmetric stiffness off the tangent. */
    press(pressure, q, stiff) {
      if (pressure === 0.0) return;
      const { model, residual, tangent } = this, { modes } = model;
      for (const side of model.sides) {
        const { byRadius, byHeight, byDr, byDz } = side, weight = pressure * side.weight;
        let radius = side.radius, dr = side.dr, dz = side.dz;
        for (let i = 0; i < modes; i += 1) {
          radius += q[i] * byRadius[i];
          dr += q[i] * byDr[i];
          dz += q[i] * byDz[i];
        }
        for (let i = 0; i < modes; i += 1) residual[i] += weight * radius * (dz * byRadius[i] - dr * byHeight[i]);
        if (!stiff) continue;
        const { across, along } = this;
        for (let i = 0; i < modes; i += 1) {
          across[i] = 0.5 * weight * (dz * byRadius[i] + radius * byDz[i]);
          along[i] = 0.5 * weight * (dr * byRadius[i] + radius * byDr[i]);
        }
        for (let i = 0; i < modes; i += 1) {
          const a = across[i], b = along[i], r = byRadius[i], z = byHeight[i], row = i * modes;
          for (let j = 0; j <= i; j += 1) tangent[row + j] += r * across[j] - z * along[j] + a * byRadius[j] - b * byHeight[j];
        }
      }
    }

    /** Forces of a change of all creep strains, into the residual. */
    errorForces(q, first, second) {
      const { model, F, at, P } = this;
      this.residual.fill(0.0);
      for (let k = 0; k < model.points; k += 1) {
        this.deform(k, q);
        if (!setStrains(F, at)) continue;
        this.points.stressOfCreepChange(k, F, at, first, second, P);
        this.addForces(k, model.weights[k]);
      }
    }

    /** Cholesky factor of the tangent in place; false where it is not positive definite. */
    factorize() {
      const { tangent, model } = this, n = model.modes;
      for (let j = 0; j < n; j += 1) {
        for (let i = j; i < n; i += 1) {
          let total = tangent[i * n + j];
          for (let k = 0; k < j; k += 1) total -= tangent[i * n + k] * tangent[j * n + k];
          if (i === j) {
            if (!(total > 0.0)) return false;
            tangent[i * n + i] = Math.sqrt(total);
          } else {
            tangent[i * n + j] = total / tangent[j * n + j];
          }
        }
      }
      return true;
    }

    /** The residual becomes the correction of q. */
    solve() {
      const { tangent, residual, model } = this, n = model.modes;
      for (let i = 0; i < n; i += 1) {
        for (let k = 0; k < i; k += 1) residual[i] -= tangent[i * n + k] * residual[k];
        residual[i] /= tangent[i * n + i];
      }
      for (let i = n - 1; i >= 0; i -= 1) {
        for (let k = i + 1; k < n; k += 1) residual[i] -= tangent[k * n + i] * residual[k];
        residual[i] /= tangent[i * n + i];
      }
    }

    /** Largest displacement, mm, of some rows of modes; NaN where one is. */
    largest(q, rows) {
      let worst = 0.0;
      for (const row of rows) {
        let total = 0.0;
        for (let i = 0; i < q.length; i += 1) total += q[i] * row[i];
        if (!Number.isFinite(total)) return NaN;
        worst = Math.max(worst, Math.abs(total));
      }
      return worst;
    }

    largestCorrection() {
      return this.largest(this.residual, this.model.measured);
    }

    largestDisplacement(q) {
      return this.largest(q, this.model.observed);
    }
  }

  Object.assign(creepkit, { unpackModel, ReducedBody });
})(globalThis.creepkit);
