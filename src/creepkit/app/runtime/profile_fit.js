// Least squares fit of a generalised Gaussian D exp(-(r/S)^p) to profiles, as the core's gaussian_fit.hpp: Newton's
// method in (D, ln S, ln p), damped where the sum of squares is not convex; r and S are shares of the window.
"use strict";

(function (creepkit) {
  const FARTHEST = 6.0, AT_REST_BELOW = 1e-9;
  const WIDTHS = [Math.log(0.02), Math.log(20.0)], SHAPES = [Math.log(0.25), Math.log(40.0)];
  const UNEXPLAINED = 0.2, CLEAR = 0.03, ITERATIONS = 60, LONGEST_STEP = 0.5, CONVERGED = 1e-7;
  const STARTS = [[0.0, 2.0], [0.0, 4.0], [0.0, 1.2], [0.25, 2.0], [0.5, 2.0], [1.0, 2.0]];

  /** ln g of an angle, |cos a|^p + |sin a|^p, with its first and second derivative to p. */
  function angularFactor(angle, p) {
    const { logCosine, logSine } = angle, cosine = Math.exp(p * logCosine), sine = Math.exp(p * logSine), g = cosine + sine;
    const first = (cosine * logCosine + sine * logSine) / g;
    return { g, first, second: (cosine * logCosine ** 2 + sine * logSine ** 2) / g - first * first };
  }

  function bestAmplitude(grid, y, x) {
    const p = Math.exp(x[2]);
    let product = 0.0, square = 0.0;
    for (const angle of grid.angles) {
      const { g } = angularFactor(angle, p);
      for (let i = 0; i < y.length; i += 1) {
        const m = Math.exp(-g * Math.exp(Math.min(p * (grid.logRadius[i] - x[1]), FARTHEST)));
        const weighted = angle.weight * grid.weights[i] * m;
        product += weighted * y[i];
        square += weighted * m;
      }
    }
    return product / square;
  }

  /** Half the sum of squares at x with its derivatives; `diagonal` is that of the Gauss-Newton part. */
  function sumUp(grid, y, x) {
    const D = x[0], p = Math.exp(x[2]), slope = [0, 0, 0], diagonal = [0, 0, 0];
    let squares = 0, m01 = 0, m02 = 0, m11 = 0, m12 = 0, m22 = 0;
    for (const angle of grid.angles) {
      const { g, first, second } = angularFactor(angle, p);
      for (let i = 0; i < y.length; i += 1) {
        const weight = angle.weight * grid.weights[i], far = grid.logRadius[i] - x[1];
        const q = g * Math.exp(Math.min(p * far, FARTHEST)), m = Math.exp(-q);
        const residual = D * m - y[i], left = weight * residual, steep = p * (far + first);
        const fq = D * m * q, fs = fq * p, fp = -fq * steep;
        squares += left * residual;
        slope[0] += left * m;
        slope[1] += left * fs;
        slope[2] += left * fp;
        diagonal[0] += weight * m * m;
        diagonal[1] += weight * fs * fs;
        diagonal[2] += weight * fp * fp;
        m01 += weight * m * fs + left * m * q * p;
        m02 += weight * m * fp - left * m * q * steep;
        m11 += left * fq * (q - 1.0) * p * p;
        m12 += weight * fs * fp + left * fq * (p - (q - 1.0) * p * steep);
        m22 += left * fq * ((q - 1.0) * steep * steep - p * p * second - steep);
      }
    }
    const matrix = [[diagonal[0]], [m01, m11 + diagonal[1]], [m02, m12, m22 + diagonal[2]]];
    return { squares: 0.5 * squares, slope, diagonal, matrix };
  }

  /** Solution of (matrix + damping diagonal) x = right; null where that is not positive definite. */
  function solveDamped({ matrix, diagonal }, right, damping) {
    const lower = [[], [], []], solution = [...right];
    for (let a = 0; a < 3; a += 1) {
      for (let b = 0; b <= a; b += 1) {
        let total = matrix[a][b] + (a === b ? damping * diagonal[a] : 0.0);
        for (let c = 0; c < b; c += 1) total -= lower[a][c] * lower[b][c];
        if (a === b && !(total > 1e-13 * diagonal[a])) return null;
        lower[a][b] = a === b ? Math.sqrt(total) : total / lower[b][b];
      }
      for (let c = 0; c < a; c += 1) solution[a] -= lower[a][c] * solution[c];
      solution[a] /= lower[a][a];
    }
    for (let a = 2; a >= 0; a -= 1) {
      for (let c = a + 1; c < 3; c += 1) solution[a] -= lower[c][a] * solution[c];
      solution[a] /= lower[a][a];
    }
    return solution;
  }

  /** ln(r/window) of where a profile has fallen to 1/e of its largest value. */
  function fallen(grid, y) {
    let peak = 0;
    for (let i = 1; i < y.length; i += 1) if (Math.abs(y[i]) > Math.abs(y[peak])) peak = i;
    for (let i = peak + 1; i < y.length; i += 1) {
      if (y[i] * y[peak] < y[peak] * y[peak] * Math.exp(-1.0)) return grid.logRadius[i];
    }
    return 0.0;
  }

  /** Minimise from x = (?, ln S, ln p); the minimum {x, squares}, or null where none is strict within the grid's sight. */
  function descend(grid, y, given) {
    let x = [bestAmplitude(grid, y, given), given[1], given[2]], normal = sumUp(grid, y, x), damping = 0.0;
    for (let iteration = 0; iteration < ITERATIONS; iteration += 1) {
      const step = solveDamped(normal, normal.slope, damping);
      if (step === null) {
        damping = Math.max(4.0 * damping, 1e-3);
        continue;
      }
      const longest = Math.max(Math.abs(step[1]), Math.abs(step[2]));
      const shrink = longest > LONGEST_STEP ? LONGEST_STEP / longest : 1.0;
      const trial = x.map((value, v) => value - shrink * step[v]), next = sumUp(grid, y, trial);
      const close = damping === 0.0 && longest < CONVERGED && Math.abs(step[0]) < CONVERGED;
      if (close || next.squares <= normal.squares) {
        x = trial;
        normal = next;
        damping = damping < 1e-5 ? 0.0 : 0.1 * damping;
      } else {
        damping = Math.max(4.0 * damping, 1e-3);
      }
      if (close) {
        const inside = WIDTHS[0] < x[1] && x[1] < WIDTHS[1] && SHAPES[0] < x[2] && x[2] < SHAPES[1];
        return inside && solveDamped(normal, normal.slope, 0.0) !== null ? { x, squares: normal.squares } : null;
      }
    }
    return null;
  }

  function fitProfile(grid, y, last) {
    const around = grid.angles.reduce((total, angle) => total + angle.weight, 0.0);
    const whole = 0.5 * around * y.reduce((total, value, i) => total + grid.weights[i] * value * value, 0.0);
    let least = UNEXPLAINED * whole, found = null;
    const starts = STARTS.map(([width, shape]) => [0, width > 0.0 ? Math.log(width) : fallen(grid, y), Math.log(shape)]);
    for (const start of last === null ? starts : [last, ...starts]) {
      const result = descend(grid, y, start);
      if (result === null || !(result.squares < least)) continue;
      found = result.x;
      least = result.squares;
      if (least < CLEAR * whole) break;
    }
    return found;
  }

  /** Amplitude mm, width mm and shape of each profile (frames of displacements of nodes, mm), as `Observation` has them. */
  function observeProfiles(observation, profiles) {
    const { window, nodes, grid } = observation, count = grid.weights.length, width = nodes.length / count;
    let last = null;
    const fits = profiles.map((profile) => {
      const y = new Float64Array(count);
      for (let i = 0; i < count; i += 1) for (let j = 0; j < width; j += 1) y[i] += nodes[i * width + j] * profile[j];
      const scale = y.reduce((most, value) => Math.max(most, Math.abs(value)), 0.0);
      if (!Number.isFinite(scale)) return [NaN, NaN, NaN];
      if (!(scale > AT_REST_BELOW)) return null;
      const x = fitProfile(grid, y.map((value) => value / scale), last);
      if (x === null) return [NaN, NaN, NaN];
      last = x;
      return [scale * x[0], window * Math.exp(x[1]), Math.exp(x[2])];
    });
    return lendToRest(fits);
  }

  /** Frames at rest have no amplitude, and the shape of the next frame that was fitted, else of the last one. */
  function lendToRest(fits) {
    const fitted = (fit) => fit !== null && !Number.isNaN(fit[0]);
    let source = [...fits].reverse().find(fitted) || null;
    for (let k = fits.length - 1; k >= 0; k -= 1) {
      if (fitted(fits[k])) source = fits[k];
      else if (fits[k] === null) fits[k] = [0.0, source ? source[1] : NaN, source ? source[2] : NaN];
    }
    return fits;
  }

  creepkit.observeProfiles = observeProfiles;
})(globalThis.creepkit);
