const pointVariables = ["stress", "strain", "time", "temperature", "principal_stress", "mean_stress"];

/** Numbers by name: those given, the rest from `defaults`, in the order of `names`. */
function ordered(what, names, defaults, given) {
  for (const name of Object.keys(given)) {
    if (!names.includes(name)) throw new RangeError(`no ${what} '${name}'; allowed are ${names.join(", ")}`);
  }
  return names.map((name, k) => (Object.prototype.hasOwnProperty.call(given, name) ? given[name] : defaults[k]));
}

function valuesOf(parameters) {
  return ordered("parameter", law.parameters.map((p) => p.name), law.parameters.map((p) => p.value), parameters);
}

/** A point by name as the numbers that `kernel` takes, converted to MPa and s. */
function pointOf(point) {
  const names = [...pointVariables, ...[...law.states, ...law.conditions].map((s) => s.name)];
  const given = ordered("variable", names, new Array(names.length).fill(undefined), point);
  const needed = ["stress", ...law.variables.filter((name) => name === "temperature"), ...law.conditions.map((c) => c.name)];
  for (const name of needed) {
    if (given[names.indexOf(name)] === undefined) throw new RangeError(`the law needs a ${name}`);
  }
  const stress = given[0] * law.megapascals;
  const initial = law.states.map((s) => s.initial);
  const defaults = [stress, 0.0, 0.0, 1.0, stress, stress / 3.0, ...initial];
  const factors = [law.megapascals, 1.0, law.seconds, 1.0, law.megapascals, law.megapascals];
  return given.map((value, k) => (value === undefined ? defaults[k] : value * (factors[k] || 1.0)));
}

/** Total rate of equivalent creep strain. point : {stress: 100, time: 3600 ...}; parameters : {} for those above. */
function rate(point, parameters = {}) {
  const out = new Float64Array(1 + law.states.length);
  kernel(valuesOf(parameters)).rates(pointOf(point), out);
  return law.seconds * out[0];
}

/** The rate of each term, by its name. */
function terms(point, parameters = {}) {
  const out = new Float64Array(law.terms.length);
  kernel(valuesOf(parameters)).terms(pointOf(point), out);
  return Object.fromEntries(law.terms.map((name, k) => [name, law.seconds * out[k]]));
}

/** The rates of the internal variables, by their names. */
function stateRates(point, parameters = {}) {
  const out = new Float64Array(1 + law.states.length);
  kernel(valuesOf(parameters)).rates(pointOf(point), out);
  return Object.fromEntries(law.states.map((state, k) => [state.name, law.seconds * out[1 + k]]));
}
