// Newton's method for the implicit stage of one material point; problem and unknown are those of the core's
// stage_problem.hpp and stage_solver.hpp:
//
//     D = w f(sigma, p0 + D, t, T, z),   z = z0 + w g(sigma, p0 + D, t, T, z),   sigma = (trial - k D) exp(load D)
//
// with the weight w in s, the strain p0 so far, the stress `trial` in MPa without further creep, k in MPa, load 0 or 1.
"use strict";

(function (creepkit) {
  const STRESS = 0, STRAIN = 1, TIME = 2, TEMPERATURE = 3, PRINCIPAL = 4, MEAN = 5, POINT = 6;
  const NO_RATE = -600.0; // ln of a rate, 1/s, below which nothing creeps
  const SMALL = 0.3; // corrections of ln D so small let `errorLeft` be trusted

  const UNIAXIAL = Object.freeze({ principal: 0.0, principalSlope: 1.0, mean: 0.0, meanSlope: 1.0 / 3.0 });

  function swap(numbers, i, j) {
    const kept = numbers[i];
    numbers[i] = numbers[j];
    numbers[j] = kept;
  }

  /** Solve matrix x = right in place (rows of `size` numbers); false when it is singular. */
  function solveDense(matrix, right, size) {
    for (let k = 0; k < size; k += 1) {
      let best = k;
      for (let i = k + 1; i < size; i += 1) {
        if (Math.abs(matrix[i * size + k]) > Math.abs(matrix[best * size + k])) best = i;
      }
      const pivot = matrix[best * size + k];
      if (!(Math.abs(pivot) > 0.0)) return false;
      if (best !== k) {
        for (let j = 0; j < size; j += 1) swap(matrix, k * size + j, best * size + j);
        swap(right, k, best);
      }
      for (let i = k + 1; i < size; i += 1) {
        const factor = matrix[i * size + k] / pivot;
        if (factor === 0.0) continue;
        for (let j = k; j < size; j += 1) matrix[i * size + j] -= factor * matrix[k * size + j];
        right[i] -= factor * right[k];
      }
    }
    for (let k = size - 1; k >= 0; k -= 1) {
      for (let i = k + 1; i < size; i += 1) right[k] -= matrix[k * size + i] * right[i];
      right[k] /= matrix[k * size + k];
    }
    return true;
  }

  /** The stage of one law: `row` and `out` are its input and output, `axes` how principal and mean stress follow. */
  class StageSolver {
    constructor(law, axes = UNIAXIAL) {
      this.law = law;
      this.axes = axes;
      this.size = 1 + law.states;
      this.width = POINT + law.states;
      this.row = new Float64Array(this.width);
      this.out = new Float64Array(this.size * (1 + this.width));
      this.trial = this.stiffness = this.load = this.weight = this.strain = 0.0;
      this.increment = this.logIncrement = this.stress = this.incrementSlope = this.stressSlope = 0.0;
      this.matrix = new Float64Array(this.size * this.size);
      this.step = new Float64Array(this.size);
      this.last = new Float64Array(this.size);
    }

    setProblem(trial, stiffness, load, weight, strain) {
      this.trial = trial;
      this.stiffness = stiffness;
      this.load = load;
      this.weight = weight;
      this.strain = strain;
    }

    /** Write stress and strain into the row; time, temperature and states are there already. */
    writePoint(stress, strain) {
      const { row, axes } = this;
      row[STRESS] = stress;
      row[STRAIN] = strain;
      row[PRINCIPAL] = axes.principal + axes.principalSlope * stress;
      row[MEAN] = axes.mean + axes.meanSlope * stress;
    }

    /** Derivative to the stress of the gradient that begins at `start` of the output. */
    byStress(start) {
      const { out, axes } = this;
      return out[start + STRESS] + axes.principalSlope * out[start + PRINCIPAL] + axes.meanSlope * out[start + MEAN];
    }

    evaluate(stress, strain) {
      this.writePoint(stress, strain);
      this.law.update(this.row, this.out);
    }

    /** Turn the unknown x = ln[D/(1 - k D/trial)] into increment and stress. */
    setUnknown(x) {
      const amount = Math.exp(Math.min(x, 700.0));
      if (this.stiffness > 0.0) {
        const ratio = (this.stiffness * amount) / this.trial, elastic = 1.0 / (1.0 + ratio);
        this.increment = amount * elastic;
        this.logIncrement = x - Math.log1p(ratio);
        this.stress = this.trial * elastic;
        this.incrementSlope = elastic;
        this.stressSlope = elastic - 1.0;
        return;
      }
      this.increment = amount;
      this.logIncrement = x;
      this.stress = this.load > 0.0 ? this.trial * Math.exp(this.load * Math.min(amount, 700.0)) : this.trial;
      this.incrementSlope = 1.0;
      this.stressSlope = this.load * amount;
    }

    unknownOf(increment) {
      const guess = Math.max(increment, 1e-300);
      if (this.stiffness === 0.0) return Math.log(guess);
      const share = (this.stiffness * guess) / this.trial;
      return share < 0.999 ? Math.log(guess) - Math.log1p(-share) : Math.log((999.0 * this.trial) / this.stiffness);
    }

    /** Bound of the error of D that a correction of `step` leaves, relative to D. */
    errorLeft(increment, incrementSlope, byStrain, byStress, slope, step) {
      const share = increment / (this.strain + increment);
      const curvature = 4.0 * Math.abs(byStrain) + (byStrain !== 0.0 ? share * share : 0.0) +
        2.0 * Math.abs(byStress) + incrementSlope * (1.0 - incrementSlope);
      return (curvature / slope) * step * step;
    }

    /** Solve the stage; states : z0, the guess of z stands in the row. Whether there is a solution, in `increment`. */
    solve(states, guess, tolerance, negligible) {
      if (this.size > 1) return this.solveWithStates(states, guess, tolerance);
      if (!(this.trial > 0.0)) {
        this.increment = 0.0;
        this.writePoint(0.0, this.strain);
        return this.trial === 0.0;
      }
      return this.solveNearGuess(guess, tolerance, negligible) || this.solveBracketed(guess, tolerance, negligible);
    }

    /** From a good guess: no bracket and half of the logarithms; false where the guess was not good enough. */
    solveNearGuess(guess, tolerance, negligible) {
      const { trial, stiffness, load, weight, strain, out } = this, relaxes = stiffness > 0.0;
      let increment = guess, share = relaxes ? (stiffness * increment) / trial : 0.0;
      for (let iteration = 0; iteration < 4; iteration += 1) {
        if (!(relaxes ? 1e-280 < share && share < 0.9999 : 1e-280 < increment && increment < 1e3)) return false;
        const elastic = 1.0 - share;
        let stress = trial * elastic;
        if (load > 0.0) stress *= Math.exp(load * increment);
        this.evaluate(stress, strain + increment);
        if (!(out[0] >= NO_RATE)) return false;
        const residual = Math.log(increment / weight) - out[0];
        const stressSlope = load > 0.0 ? load * increment : -share;
        const byStrain = increment * elastic * out[1 + STRAIN], byStress = stress * stressSlope * this.byStress(1);
        const slope = elastic - byStrain - byStress, step = -residual / slope;
        if (!(slope > 0.0 && Math.abs(step) < 1.0)) return false;
        const left = increment * this.errorLeft(increment, elastic, byStrain, byStress, slope, step);
        const enough = Math.abs(step) <= tolerance || (Math.abs(step) < SMALL && left < negligible);
        if (relaxes) {
          const ratio = (share / elastic) * Math.exp(step);
          share = ratio / (1.0 + ratio);
          increment = (trial / stiffness) * share;
        } else {
          increment *= Math.exp(step);
        }
        if (enough) {
          stress = trial * (1.0 - share);
          if (load > 0.0) stress *= Math.exp(load * increment);
          this.writePoint(stress, strain + increment);
          this.increment = increment;
          this.stress = stress;
          return true;
        }
      }
      return false;
    }

    /** Newton's method in x, bracketed. */
    solveBracketed(guess, tolerance, negligible) {
      const { out, strain } = this, logWeight = Math.log(this.weight);
      let x = this.unknownOf(guess), low = -Infinity, high = Infinity, before = Infinity;
      for (let iteration = 0; iteration < 80; iteration += 1) {
        this.setUnknown(x);
        this.evaluate(this.stress, strain + this.increment);
        const nothing = out[0] < NO_RATE;
        if (nothing && this.stress > 0.99 * this.trial) {
          this.writePoint(this.trial, strain);
          this.increment = 0.0;
          this.stress = this.trial;
          return true;
        }
        const residual = nothing ? Infinity : this.logIncrement - logWeight - out[0];
        if (!Number.isFinite(residual) && !nothing) return false;
        const byStrain = nothing ? 0.0 : this.increment * this.incrementSlope * out[1 + STRAIN];
        const byStress = nothing ? 0.0 : this.stress * this.stressSlope * this.byStress(1);
        const slope = nothing ? 1.0 : this.incrementSlope - byStrain - byStress;
        if (residual > 0.0) high = x;
        else low = x;
        const closed = Number.isFinite(low) && Number.isFinite(high);
        if (!(slope > 0.0) && !closed) return false;
        let step = slope > 0.0 ? -residual / slope : Infinity;
        const left = this.increment * this.errorLeft(this.increment, this.incrementSlope, byStrain, byStress, slope, step);
        if (Math.abs(step) <= tolerance || (Math.abs(step) < SMALL && left < negligible)) {
          this.setUnknown(x + step);
          this.writePoint(this.stress, strain + this.increment);
          return true;
        }
        if (!(low < x + step && x + step < high) || Math.abs(step) > 0.5 * before) {
          step = closed ? 0.5 * (low + high) - x : Math.min(Math.max(step, -60.0), 60.0);
        }
        before = Math.abs(step);
        x += step;
      }
      return false;
    }

    /** Damped Newton's method in (x, z). */
    solveWithStates(states, guess, tolerance) {
      const { row, out, size, width, matrix, step, last, strain, weight } = this;
      if (!(this.trial >= 0.0)) return false;
      last.fill(0.0);
      let creeps = this.trial > 0.0, x = creeps ? this.unknownOf(guess) : 0.0, halvings = 0;
      this.clearIterate();
      for (let iteration = 0; iteration < 80; iteration += 1) {
        if (creeps) this.setUnknown(x);
        else this.clearIterate();
        this.evaluate(this.stress, strain + this.increment);
        creeps = creeps && !(out[0] < NO_RATE);
        let sum = 0.0;
        for (let i = creeps ? 0 : 1; i < size; i += 1) sum += out[i];
        if (!Number.isFinite(sum)) {
          halvings += 1;
          if (halvings > 12) return false;
          for (let i = 1; i < size; i += 1) row[POINT + i - 1] -= 0.5 * last[i];
          x -= 0.5 * last[0];
          for (let i = 0; i < size; i += 1) last[i] *= 0.5;
          continue;
        }
        for (let i = 0; i < size; i += 1) {
          const start = size + i * width, factor = i > 0 ? weight : creeps ? 1.0 : 0.0;
          const byStrain = this.increment * this.incrementSlope * out[start + STRAIN];
          const byStress = this.stress * this.stressSlope * this.byStress(start);
          matrix[i * size] = creeps ? -factor * (byStrain + byStress) : 0.0;
          for (let j = 1; j < size; j += 1) {
            matrix[i * size + j] = factor > 0.0 ? -factor * out[start + POINT + j - 1] : 0.0;
          }
          matrix[i * size + i] += i > 0 || !creeps ? 1.0 : this.incrementSlope;
          if (i > 0) step[i] = states[i - 1] + weight * out[i] - row[POINT + i - 1];
        }
        step[0] = creeps ? Math.log(weight) + out[0] - this.logIncrement : 0.0;
        if (!solveDense(matrix, step, size)) return false;
        const damping = Math.min(1.0, 5.0 / Math.max(Math.abs(step[0]), 1e-300));
        for (let i = 0; i < size; i += 1) last[i] = damping * step[i];
        for (let i = 1; i < size; i += 1) row[POINT + i - 1] += last[i];
        x += last[0];
        halvings = 0;
        let small = !(Math.abs(last[0]) > tolerance);
        for (let i = 1; i < size && small; i += 1) {
          small = !(Math.abs(last[i]) > tolerance * Math.max(Math.abs(row[POINT + i - 1]), 1e-12));
        }
        if (small) {
          if (creeps) this.setUnknown(x);
          this.writePoint(this.stress, strain + this.increment);
          return true;
        }
      }
      return false;
    }

    clearIterate() {
      this.increment = this.logIncrement = this.stress = this.incrementSlope = this.stressSlope = 0.0;
    }
  }

  Object.assign(creepkit, { StageSolver, solveDense, point: { STRESS, STRAIN, TIME, TEMPERATURE, PRINCIPAL, MEAN, POINT } });
})(globalThis.creepkit);
