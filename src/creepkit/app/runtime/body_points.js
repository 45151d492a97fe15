// The material points of a body: Hencky elasticity, von Mises creep by the Cauchy stress, one after another; formulas are
// those of the core's material_point.hpp. A stage is {weight, time, temperature, bulk, shear, pressure}.
"use strict";

(function (creepkit) {
  const { SUM, DIFFERENCE, HOOP, SHEAR, VOLUME, STRAIN } = creepkit.kinematics;
  const { piolaStress, piolaTangent } = creepkit.kinematics;
  const { PRINCIPAL, MEAN, POINT } = creepkit.point;
  const NO_RATE = -600.0, ITERATIONS = 12, LONGEST = 3.0, THIRD = 1.0 / 3.0;
  const COMPONENTS = 3, EQUIVALENT = 3; // creep components, then the equivalent creep strain, then the states

  /** State of all points, and the law at them. Arrays of several quantities have one after the other, `count` each. */
  class BodyPoints {
    constructor(law, count) {
      const axes = { principal: 0.0, principalSlope: 0.0, mean: 0.0, meanSlope: 0.0 };
      this.law = law;
      this.count = count;
      this.values = EQUIVALENT + 1 + law.states;
      this.solver = new creepkit.StageSolver(law, axes);
      const array = (size) => new Float64Array(size * count);
      this.value = array(this.values);
      this.base = array(this.values);
      this.slopes = [array(this.values), array(this.values)];
      this.state = array(law.states);
      this.increments = array(1);
      this.mises = array(1);
      this.directions = array(COMPONENTS);
      this.deviator = array(6);
      this.trials = array(1);
      this.byTrials = array(1);
      this.history = new Float64Array(law.states);
      const size = 1 + law.states;
      this.matrix = new Float64Array(size * size);
      this.right = new Float64Array(size);
      this.T = new Float64Array(4);
      this.moduli = new Float64Array(16);
      this.increment = this.byTrial = this.byPrincipal = this.byMean = 0.0;
      this.undefinedRate = false;
      this.usesPrincipal = law.law.variables.includes("principal_stress");
      this.usesMean = law.law.variables.includes("mean_stress");
      law.initial.forEach((initial, s) => {
        this.value.fill(initial, (EQUIVALENT + 1 + s) * count, (EQUIVALENT + 2 + s) * count);
        this.state.fill(initial, s * count, (s + 1) * count);
      });
    }

    /** From F of point k, with its strains in `at`, to P and, if `stiff`, A = dP/dF; false where the point fails. */
    update(stage, k, F, at, stiff, tolerance, P, A) {
      const { count, base, T } = this;
      const trace = at[STRAIN + SUM] + at[STRAIN + HOOP], volume = at[VOLUME];
      const hoop = at[STRAIN + HOOP] - trace * THIRD - base[k];
      const difference = at[STRAIN + DIFFERENCE] - base[count + k], shear = at[STRAIN + SHEAR] - base[2 * count + k];
      const radius2 = difference * difference + shear * shear, radius = Math.sqrt(radius2);
      const equivalent = Math.sqrt(hoop * hoop + radius2 * THIRD), inverse = equivalent > 0.0 ? 1.0 / equivalent : 0.0;
      const mean = (stage.bulk * trace) / volume, top = Math.max(2.0 * hoop, radius - hoop) * inverse * THIRD;
      const stiffness = (3.0 * stage.shear) / volume, trial = stiffness * equivalent;
      this.increment = this.byTrial = this.byPrincipal = this.byMean = 0.0;
      if (stage.weight > 0.0 && equivalent > 0.0) {
        if (!this.creep(stage, k, trial, stiffness, equivalent, mean, top, tolerance, stiff)) return false;
      }
      const increment = this.increment;
      this.increments[k] = increment;
      this.trials[k] = trial;
      this.mises[k] = trial - stiffness * increment;
      this.directions[k] = hoop * inverse;
      this.directions[count + k] = difference * inverse;
      this.directions[2 * count + k] = shear * inverse;
      const left = 1.0 - increment * inverse, pressure = stage.bulk * trace, modulus = stage.shear * left;
      T[SUM] = pressure - modulus * hoop;
      T[DIFFERENCE] = modulus * difference;
      T[HOOP] = pressure + 2.0 * modulus * hoop;
      T[SHEAR] = modulus * shear;
      piolaStress(F, at, T, P);
      if (!stiff) return true;
      this.byTrials[k] = this.byTrial;
      // derivatives of D to w and to the trace
      const stress = stiffness * (equivalent - increment), along = this.byTrial * stiffness * inverse;
      let by0 = along * hoop, by1 = along * difference * THIRD, by2 = along * shear * THIRD, by3 = -(this.byTrial * stress);
      if (this.byPrincipal !== 0.0 || this.byMean !== 0.0) {
        const turned = this.byPrincipal * stress * inverse * THIRD;
        const shrink = this.byPrincipal * stress * top * inverse * inverse, hoopLargest = 2.0 * hoop > radius - hoop;
        const over = radius > 0.0 ? 1.0 / radius : 0.0;
        by0 += (hoopLargest ? 2.0 * turned : -turned) - shrink * hoop;
        by1 += (hoopLargest ? 0.0 : turned * difference * over) - shrink * difference * THIRD;
        by2 += (hoopLargest ? 0.0 : turned * shear * over) - shrink * shear * THIRD;
        by3 += (this.byMean + this.byPrincipal) * (stage.bulk / volume - mean);
      }
      this.setModuli(stage, k, increment, inverse, hoop, difference * THIRD, shear * THIRD, by0, by1, by2, by3);
      piolaTangent(F, at, this.moduli, T, A);
      return true;
    }

    /** Consistent tangent dT/dE, its symmetric part, and what `stressOfCreepChange` needs of it. d : w with g. */
    setModuli(stage, k, increment, inverse, d0, d1, d2, by0, by1, by2, by3) {
      const { moduli, deviator, count } = this, shear3 = 3.0 * stage.shear, bulk = stage.bulk;
      const left = 1.0 - increment * inverse, factor = shear3 * inverse;
      const bend = factor * increment * inverse * inverse, vt = -(factor * by3);
      const w00 = d0 * (bend * d0 - factor * by0) + shear3 * left;
      const w11 = d1 * (bend * d1 - factor * by1) + stage.shear * left;
      const w22 = d2 * (bend * d2 - factor * by2) + stage.shear * left;
      const w01 = 0.5 * (d0 * (bend * d1 - factor * by1) + d1 * (bend * d0 - factor * by0));
      const w02 = 0.5 * (d0 * (bend * d2 - factor * by2) + d2 * (bend * d0 - factor * by0));
      const w12 = 0.5 * (d1 * (bend * d2 - factor * by2) + d2 * (bend * d1 - factor * by1));
      const t0 = d0 * vt, t1 = d1 * vt, t2 = d2 * vt, s = t0 - THIRD * w00, h = t0 + 2.0 * THIRD * w00;
      moduli[0] = bulk - THIRD * s;
      moduli[2] = moduli[8] = 0.5 * (bulk - THIRD * h + bulk + 2.0 * THIRD * s);
      moduli[10] = bulk + 2.0 * THIRD * h;
      moduli[1] = moduli[4] = 0.5 * (-THIRD * w01 + t1 - THIRD * w01);
      moduli[6] = moduli[9] = 0.5 * (2.0 * THIRD * w01 + t1 + 2.0 * THIRD * w01);
      moduli[3] = moduli[12] = 0.5 * (-THIRD * w02 + t2 - THIRD * w02);
      moduli[11] = moduli[14] = 0.5 * (2.0 * THIRD * w02 + t2 + 2.0 * THIRD * w02);
      moduli[5] = w11;
      moduli[7] = moduli[13] = w12;
      moduli[15] = w22;
      deviator[k] = 1.5 * (moduli[10] - moduli[8]);
      deviator[count + k] = moduli[5];
      deviator[2 * count + k] = moduli[15];
      deviator[3 * count + k] = moduli[6] - moduli[4];
      deviator[4 * count + k] = moduli[14] - moduli[12];
      deviator[5 * count + k] = moduli[7];
    }

    /** The creep increment of point k and its derivatives; false where none is found. */
    creep(stage, k, trial, stiffness, equivalent, mean, top, tolerance, stiff) {
      const { solver, count } = this, { row, out, axes } = solver;
      let guess = this.increments[k];
      if (this.trials[k] >= 0.0) {
        const moved = guess + this.byTrials[k] * (trial - this.trials[k]);
        if (moved > 0.0) guess = moved;
      }
      if (!(guess > 0.0)) guess = 1e-6 * equivalent;
      axes.principal = axes.mean = mean;
      axes.principalSlope = top;
      row[creepkit.point.TIME] = stage.time;
      row[creepkit.point.TEMPERATURE] = stage.temperature;
      const strain = this.base[EQUIVALENT * count + k];
      if (this.law.states > 0) {
        return this.creepWithStates(stage, k, trial, stiffness, strain, guess, tolerance, stiff);
      }
      let share = Math.min(guess / equivalent, 0.9999), settled = false;
      if (!(share > 1e-280)) share = 1e-6;
      for (let iteration = 0; iteration < ITERATIONS && !settled; iteration += 1) {
        const left = 1.0 - share, stress = trial * left, increment = equivalent * share;
        row[0] = stress;
        row[1] = strain + increment;
        row[PRINCIPAL] = mean + top * stress;
        row[MEAN] = mean;
        this.law.update(row, out);
        const byStress = out[1] + top * out[1 + PRINCIPAL];
        const residual = Math.log(increment) - stage.logWeight - out[0];
        const slope = left * (1.0 - increment * out[2]) + share * stress * byStress;
        let step = -(residual / slope);
        if (!(slope > 0.0 && out[0] > NO_RATE && Math.abs(step) < 1e3)) break;
        step = Math.max(-LONGEST, Math.min(LONGEST, step));
        const ratio = (share / left) * Math.exp(step);
        share = Math.max(1e-290, Math.min(1.0 - 1e-9, ratio / (1.0 + ratio)));
        settled = !(Math.abs(step) > tolerance);
      }
      if (settled) {
        this.increment = equivalent * share;
      } else {
        solver.setProblem(trial, stiffness, 0.0, stage.weight, strain);
        if (!solver.solveBracketed(guess, tolerance, 0.0)) {
          this.undefinedRate = !Number.isFinite(out[0]);
          return false;
        }
        this.increment = solver.increment;
      }
      if (!(this.increment > 0.0)) return true;
      const along = this.increment * (out[1] + top * out[1 + PRINCIPAL]);
      const divisor = 1.0 / (1.0 + along * stiffness - this.increment * out[2]);
      this.byTrial = along * divisor;
      this.byPrincipal = this.increment * out[1 + PRINCIPAL] * divisor;
      this.byMean = this.increment * out[1 + MEAN] * divisor;
      return true;
    }

    creepWithStates(stage, k, trial, stiffness, strain, guess, tolerance, stiff) {
      const { solver, count, history, law } = this, { row, out } = solver, first = EQUIVALENT + 1;
      for (let i = 0; i < law.states; i += 1) {
        row[POINT + i] = this.state[i * count + k];
        history[i] = this.base[(first + i) * count + k];
      }
      solver.setProblem(trial, stiffness, 0.0, stage.weight, strain);
      if (!solver.solve(history, guess, tolerance, 0.0)) {
        this.undefinedRate = !Number.isFinite(out[0]);
        return false;
      }
      this.increment = solver.increment;
      for (let i = 0; i < law.states; i += 1) this.state[i * count + k] = row[POINT + i];
      if (!(this.increment > 0.0) || !stiff) return true;
      this.byTrial = this.stateResponse(stage, -1, stiffness);
      if (this.usesPrincipal) this.byPrincipal = this.stateResponse(stage, PRINCIPAL, stiffness);
      if (this.usesMean) this.byMean = this.stateResponse(stage, MEAN, stiffness);
      return true;
    }

    /** Derivative of D to the trial stress (variable -1), or to a shift of a variable of the point. */
    stateResponse(stage, variable, stiffness) {
      const { solver, matrix, right, increment } = this, { size, width, out } = solver;
      for (let i = 0; i < size; i += 1) {
        const start = size + i * width, factor = i === 0 ? increment : stage.weight;
        matrix[i * size] = factor * (-out[start + 1] + solver.byStress(start) * stiffness);
        for (let j = 1; j < size; j += 1) matrix[i * size + j] = -factor * out[start + POINT + j - 1];
        matrix[i * size + i] += 1.0;
        right[i] = factor * (variable < 0 ? solver.byStress(start) : out[start + variable]);
      }
      return creepkit.solveDense(matrix, right, size) ? right[0] : 0.0;
    }

    /** Stress P of a change of creep strain by first slopes[0] + second slopes[1], through the tangent of the stage. */
    stressOfCreepChange(k, F, at, first, second, P) {
      const { count, deviator, T } = this, [one, two] = this.slopes;
      const change = (v) => first * one[v * count + k] + second * two[v * count + k];
      const c0 = change(0), c1 = change(1), c2 = change(2), kept = (i) => deviator[i * count + k];
      const hoop = kept(0) * c0 + kept(3) * c1 + kept(4) * c2;
      T[SUM] = hoop * THIRD;
      T[DIFFERENCE] = -(kept(3) * c0 + kept(1) * c1 + kept(5) * c2);
      T[HOOP] = -2.0 * hoop * THIRD;
      T[SHEAR] = -(kept(4) * c0 + kept(5) * c1 + kept(2) * c2);
      piolaStress(F, at, T, P);
    }
  }

  Object.assign(creepkit, { BodyPoints, COMPONENTS, EQUIVALENT });
})(globalThis.creepkit);
