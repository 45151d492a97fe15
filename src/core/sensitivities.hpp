// Exact derivatives of the accepted steps: to the law's parameters, to the load history, to the geometry.
//
// After a step is accepted each of its stages is differentiated: its equations are linear in the changes, with the exact
// tangent (which is slightly unsymmetric) and one right-hand side for each of the C = P + D + G columns: P internal
// parameters of the law, D directions of the load history, G numbers of the geometry that move the nodes. Columns are
// padded to whole vectors of the processor and worked on in blocks of one vector.
#pragma once

#include "load_segments.hpp"
#include "material_point.hpp"
#include "step_record.hpp"
#include "time_integration.hpp"
#include "workspace.hpp"

namespace creepkit {

// What is differentiated to, beside the law's parameters; arrays of the elements include the padding of the model.
struct SensitivityDirections {
    int64_t directions, geometries;
    const double* segments;    // (D, segments, 10) change of the segments of the load history
    const double* gradients;   // (G, elements, 4, 2, 2) derivative of the nodes' velocity to r and z, 1
    const double* hoops;       // (G, elements, 4) radial velocity over the radius, 1
    const double* velocities;  // (G, 2 nodes) mm
    const double* forces;      // (G, dead forces) N/rad, change of the dead forces of a unit of the load
};

// Derivatives of the record's rows: surface (rows, observed, C) of what is observed; times (rows, D) s.
struct SensitivityRecord {
    double *surface, *times;
};

// Rows of the changes of what the body is given: pressure, time, temperature, ln E, ln weight and motion.
enum InputChange { BY_PRESSURE, BY_MOMENT, BY_LOAD_TEMPERATURE, BY_STIFFNESS, BY_WEIGHT, BY_MOTION, INPUT_CHANGES };

template <class System>
class StageSensitivities {
public:
    StageSensitivities(const PointLaw& law, const SensitivityDirections& directions, SensitivityRecord& record)
        : directions(directions), record(record), columns(law.parameters + directions.directions + directions.geometries),
          padded(whole_vectors(columns)) {}

    void take(Workspace& memory, const System& system, const PointLaw& law) {
        const int64_t points = system.point_count(), values = EQUIVALENT_STRAIN + 1 + law.states, unknowns = 1 + law.states;
        change = memory.doubles(points * values * padded);
        for (int i = 0; i < STAGES; ++i) rates[i] = memory.doubles(points * values * padded);
        own = memory.doubles(points * unknowns * padded);
        follow = memory.doubles(points * unknowns * 4);
        stress_change = memory.doubles(EIGHT * 5 * padded);
        response = memory.doubles(unknowns * (INPUTS + law.states + law.parameters) * EIGHT);
        law_input = memory.doubles((POINT_SIZE + law.states) * EIGHT);
        law_output = memory.doubles(unknowns * (1 + POINT_SIZE + law.states + law.parameters) * EIGHT);
        point_output = memory.doubles(unknowns * (1 + POINT_SIZE + law.states + law.parameters));
        point_response = memory.doubles(unknowns * (INPUTS + law.states + law.parameters));
        inputs = memory.doubles(INPUT_CHANGES * (directions.directions > 0 ? directions.directions : 1));
        system_memory.take(memory, system, padded);
    }

    // Derivatives of the step of length h from `s` in segment n; h = 0 is a sudden change of load, with one stage.
    //
    // points : with the history at the start of the step and the slopes of its stages. stages : displacements of each.
    bool differentiate(System& system, const PointLaw& law, const PointStates& points, const SimulationInput& input,
                       int64_t n, double s, double h, const Tableau& tableau, double* const* stages, int64_t row) {
        const double* segment = input.segments + SEGMENT_COLUMNS * n;
        const bool sudden = h == 0.0;
        for (int i = 0; i < (sudden ? 1 : STAGES); ++i) {
            const double at = s + tableau.c[i] * h;
            double time = segment[START], weight = 0.0;
            if (!sudden) {
                const TransformedTime now = transformed_time(segment_transformation(segment, input.beta), at);
                time = now.time;
                weight = tableau.a[i][i] * h * exp(now.log_pace);
            }
            const StageConditions stage = stage_at(segment, input.poisson, time, weight);
            set_inputs(input, n, at, sudden);
            system_memory.clear(system);
            differentiate_points(system, law, points, stage, stages[i], i, h, tableau);
            system_memory.press(system, stage.pressure, stages[i], directions, inputs, law.parameters, padded);
            if (!system_memory.solve(system, padded)) return false;
            if (!sudden) differentiate_slopes(system, law, points, stage, stages[i], i, h, tableau);
        }
        for (int64_t d = 0; d < directions.directions; ++d)
            record.times[row * directions.directions + d] = inputs[BY_MOMENT * directions.directions + d];
        if (!sudden) {
            const int64_t count = points.count * points.values * padded;
            const double first = h * tableau.a[STAGES - 1][0], last = h * tableau.a[STAGES - 1][1];
            for (int64_t k = 0; k < count; k += LANES)
                store(change + k, load(change + k) + first * load(rates[0] + k) + last * load(rates[1] + k));
        }
        system_memory.write_surface(system, record.surface + row * system.observed_count() * columns, columns, padded);
        return true;
    }

private:
    const SensitivityDirections& directions;
    SensitivityRecord& record;
    const int64_t columns, padded;
    double *change = nullptr, *rates[STAGES] = {}, *own = nullptr, *follow = nullptr, *stress_change = nullptr;
    double *response = nullptr, *law_input = nullptr, *law_output = nullptr, *inputs = nullptr;
    double *point_output = nullptr, *point_response = nullptr;
    typename System::SensitivityMemory system_memory;

    // Change of pressure, time, temperature, ln E, ln weight and motion with each direction, at place `s` of segment `n`.
    void set_inputs(const SimulationInput& input, int64_t n, double s, bool sudden) {
        constexpr double NUDGE = 1e-6;  // share of a segment's length, or start, by which its ends are moved
        const double* segment = input.segments + SEGMENT_COLUMNS * n;
        const double length = segment[END] - segment[START];
        const double time = sudden ? segment[START] : transformed_time(segment_transformation(segment, input.beta), s).time;
        const double share = sudden ? 0.0 : (time - segment[START]) / length;
        const double modulus = segment[MODULUS] + share * (segment[END_MODULUS] - segment[MODULUS]);
        const int64_t count = directions.directions;
        for (int64_t d = 0; d < count; ++d) {
            const double* by = directions.segments + (d * input.segment_count + n) * SEGMENT_COLUMNS;
            const double longer = by[END] - by[START];
            double later = by[START], slower = 0.0;
            if (!sudden && (by[START] != 0.0 || longer != 0.0)) {
                const double step = NUDGE * (segment[START] > 0.0 ? fmin(length, segment[START]) : length);
                TransformedTime moved[2];
                for (int sign = 0; sign < 2; ++sign) {
                    double nudged[SEGMENT_COLUMNS];
                    for (int c = 0; c < SEGMENT_COLUMNS; ++c) nudged[c] = segment[c] + (sign ? -step : step) * by[c];
                    moved[sign] = transformed_time(segment_transformation(nudged, input.beta), s);
                }
                later = (moved[0].time - moved[1].time) / (2.0 * step);
                slower = (moved[0].log_pace - moved[1].log_pace) / (2.0 * step);
            }
            const double along = sudden ? 0.0 : (later - by[START] - share * longer) / length;
            const auto total = [&](int first, int last) {
                return by[first] + share * (by[last] - by[first]) + along * (segment[last] - segment[first]);
            };
            inputs[BY_PRESSURE * count + d] = total(PRESSURE, END_PRESSURE);
            inputs[BY_MOTION * count + d] = total(MOTION, END_MOTION);
            inputs[BY_LOAD_TEMPERATURE * count + d] = total(START_TEMPERATURE, FINAL_TEMPERATURE);
            inputs[BY_STIFFNESS * count + d] = total(MODULUS, END_MODULUS) / modulus;
            inputs[BY_MOMENT * count + d] = later;
            inputs[BY_WEIGHT * count + d] = slower;
        }
    }

    // History (V, 8) of eight points in stage `i`.
    void stage_history(const PointStates& points, int64_t k, int i, double h, const Tableau& tableau, double* history) const {
        const int64_t stride = points.values * points.count;
        for (int64_t v = 0; v < points.values; ++v)
            for (int lane = 0; lane < EIGHT; lane += LANES) {
                const int64_t place = v * points.count + k + lane;
                Vector total = load(points.value + place);
                for (int j = 0; j < i; ++j) total += h * tableau.a[i][j] * load(points.slopes + j * stride + place);
                store(history + EIGHT * v + lane, total);
            }
    }

    // Changes of value `v` of the history of a point in stage `i`, one block of columns.
    CREEPKIT_INLINE Vector history_change(int64_t place, int i, double h, const Tableau& tableau) const {
        Vector total = load(change + place);
        for (int j = 0; j < i; ++j) total += h * tableau.a[i][j] * load(rates[j] + place);
        return total;
    }

    // Kinematics, predictors and creep increments of the points of a vector in a stage. history : (V, 8) of the eight.
    CREEPKIT_INLINE void set_points(const System& system, const PointStates& points, const StageConditions& stage,
                                    const double* u, int i, double share, int64_t k, const double* history,
                                    Kinematics& at, ElasticPredictor& p, Vector& increment) const {
        system.deform(k, u, at);
        if (!set_strains(at)) __builtin_unreachable();  // the stage has just converged here
        p = elastic_predictor(stage, at, history + k % EIGHT, EIGHT);
        const int64_t place = (i * points.values + EQUIVALENT_STRAIN) * points.count + k;
        increment = share > 0.0 ? share * load(points.slopes + place) : Vector{};
    }

    // Exact tangent, and minus the out-of-balance forces of every column at fixed displacements.
    void differentiate_points(System& system, const PointLaw& law, const PointStates& points, const StageConditions& stage,
                              const double* u, int i, double h, const Tableau& tableau) {
        const int64_t unknowns = 1 + law.states, width = INPUTS + law.states + law.parameters, values = points.values;
        const double share = tableau.a[i][i] * h;
        alignas(64) double history[(EQUIVALENT_STRAIN + 1 + MAX_STATES) * EIGHT], mean[EIGHT], mises[EIGHT], weights[EIGHT];
        alignas(64) double scalars[3][3][EIGHT], conjugate[3][EIGHT], unit[5][3][EIGHT], piola[5][EIGHT], tangent[25][EIGHT];
        for (int64_t k = 0; k < points.count; k += EIGHT) {
            Kinematics at[VECTORS];
            ElasticPredictor predictors[VECTORS];
            Vector increments[VECTORS];
            stage_history(points, k, i, h, tableau, history);
            for (int v = 0; v < VECTORS; ++v)
                set_points(system, points, stage, u, i, share, k + v * LANES, history, at[v], predictors[v], increments[v]);
            set_response(law, points, stage, predictors, increments, history, k, i, share, h > 0.0);
            for (int v = 0; v < VECTORS; ++v) {
                const ElasticPredictor& p = predictors[v];
                const Vector increment = increments[v];
                const int first = v * LANES;
                Vector by[4] = {}, moduli[4][4], by_w[3][3], stress[4], P[5];
                for (int64_t r = 0; r < unknowns; ++r) {
                    const double* answer = response + r * width * EIGHT + first;
                    const CreepDerivatives derivatives = {load(answer + BY_TRIAL * EIGHT),
                                                          load(answer + BY_PRINCIPAL * EIGHT),
                                                          load(answer + BY_MEAN * EIGHT)};
                    Vector along[4];
                    strain_derivatives(stage, p, increment, derivatives, along);
                    for (int j = 0; j < 4; ++j) {
                        if (r == 0) by[j] = along[j];
                        for (int lane = 0; lane < LANES; ++lane)
                            follow[((k + first + lane) * unknowns + r) * 4 + j] = along[j][lane];
                    }
                }
                tangent_moduli<false>(stage, p, increment, by, moduli, by_w);
                log_stress(stage, p, increment, stress);
                piola_stress(at[v], stress, P);
                const Vector weight = load(system.model.weights + k + first);
                piola_tangent(at[v], moduli, stress, weight, tangent[0] + first);
                // y, conjugate to w, changes at fixed strain: w falls as the history rises, D changes on its own
                const Vector factor = 3.0 * stage.shear * p.inverse, third = splat(1.0 / 3.0), zero{}, one = splat(1.0);
                const Vector alongs[3] = {factor * p.hoop, factor * p.difference * third, factor * p.shear * third};
                const Vector units[3][4] = {
                    {-third, zero, 2.0 * third, zero}, {zero, one, zero, zero}, {zero, zero, zero, one}};
                for (int a = 0; a < 3; ++a) {
                    for (int b = 0; b < 3; ++b) store(scalars[a][b] + first, by_w[a][b]);
                    store(conjugate[a] + first, select(increment > zero, alongs[a], zero));
                    Vector changed[5];
                    piola_stress(at[v], units[a], changed);
                    for (int c = 0; c < 5; ++c) store(unit[c][a] + first, changed[c]);
                }
                for (int c = 0; c < 5; ++c) store(piola[c] + first, P[c]);
                store(mean + first, p.mean);
                store(mises + first, p.stiffness * (p.equivalent - increment));
                store(weights + first, weight);
            }
            system.apply_factors(k / EIGHT, piola[0], 1);
            system.apply_factors(k / EIGHT, tangent[0], 5);
            system.apply_factors(k / EIGHT, unit[0][0], 3);
            system_memory.add_tangent(system, k / EIGHT, tangent);
            for (int lane = 0; lane < EIGHT; ++lane) {
                const double scale = weights[lane];
                double* stresses = stress_change + lane * 5 * padded;
                set_own_changes(law, mean[lane], mises[lane], points, k + lane, lane, i, h, tableau);
                const int64_t place = (k + lane) * values * padded;
                for (int64_t block = 0; block < padded; block += LANES) {
                    Vector w[3], y[3];
                    for (int v = 0; v < 3; ++v) w[v] = history_change(place + v * padded + block, i, h, tableau);
                    const Vector q = load(own + (k + lane) * unknowns * padded + block);
                    for (int a = 0; a < 3; ++a)
                        y[a] = -(scalars[a][0][lane] * w[0] + scalars[a][1][lane] * w[1] + scalars[a][2][lane] * w[2] +
                                 conjugate[a][lane] * q);
                    for (int c = 0; c < 5; ++c)
                        store(stresses + c * padded + block,
                              scale * (unit[c][0][lane] * y[0] + unit[c][1][lane] * y[1] + unit[c][2][lane] * y[2]));
                }
                for (int64_t d = 0; d < directions.directions; ++d) {
                    const double stiffer = inputs[BY_STIFFNESS * directions.directions + d];
                    for (int c = 0; c < 5; ++c)
                        stresses[c * padded + law.parameters + d] += scale * stiffer * piola[c][lane];
                }
                for (int64_t g = 0; g < directions.geometries; ++g)
                    add_shape_change(system, g, k + lane, at[lane / LANES], lane, piola, tangent, scale,
                                     stresses + law.parameters + directions.directions + g);
            }
            system_memory.subtract_forces(system, k / EIGHT, stress_change, padded);
        }
    }

    // How D and the states of eight points respond to the inputs of the stage and to the parameters, into `response`
    // (unknowns, INPUTS + S + P, 8).
    void set_response(const PointLaw& law, const PointStates& points, const StageConditions& stage,
                      const ElasticPredictor predictors[VECTORS], const Vector increments[VECTORS], const double* history,
                      int64_t k, int i, double share, bool creeps) {
        const int64_t states = law.states, unknowns = 1 + states, width = INPUTS + states + law.parameters;
        const Vector zero{};
        Mask moving{};
        for (int v = 0; v < VECTORS; ++v) moving |= increments[v] > zero;
        if (!creeps || (states == 0 && !any(moving))) {
            memset(static_cast<void*>(response), 0, sizeof(double) * size_t(unknowns * width * EIGHT));
            for (int64_t r = 1; r < unknowns; ++r)
                for (int lane = 0; lane < EIGHT; ++lane) response[(r * width + INPUTS + r - 1) * EIGHT + lane] = 1.0;
            return;
        }
        for (int v = 0; v < VECTORS; ++v) {
            const ElasticPredictor& p = predictors[v];
            const int64_t first = v * LANES;
            const Vector stress = p.stiffness * (p.equivalent - increments[v]);
            double* row = law_input + first;
            store(row + STRESS * EIGHT, stress);
            store(row + STRAIN * EIGHT, load(history + EQUIVALENT_STRAIN * EIGHT + first) + increments[v]);
            store(row + TIME * EIGHT, splat(stage.time));
            store(row + TEMPERATURE * EIGHT, splat(stage.temperature));
            store(row + PRINCIPAL_STRESS * EIGHT, p.mean + p.top * stress);
            store(row + MEAN_STRESS * EIGHT, p.mean);
            for (int64_t z = 0; z < states; ++z) {
                const int64_t value = EQUIVALENT_STRAIN + 1 + z;
                const double* slopes = points.slopes + (i * points.values + value) * points.count + k + first;
                store(row + (POINT_SIZE + z) * EIGHT, load(history + EIGHT * value + first) + share * load(slopes));
            }
        }
        law.sensitivity(EIGHT, law_input, law.theta, law_output);
        for (int v = 0; v < VECTORS && states == 0; ++v) {
            const Mask creeping = increments[v] > zero;
            const Vector weight = select(creeping, splat(stage.weight), zero);
            double* answer = response + v * LANES;
            const auto slope = [&](int64_t column) {
                return select(creeping, weight * load(law_output + (1 + column) * EIGHT + v * LANES), zero);
            };
            const Vector by_stress = slope(STRESS) + predictors[v].top * slope(PRINCIPAL_STRESS);
            const Vector inverse = 1.0 / (1.0 - slope(STRAIN) + by_stress * predictors[v].stiffness);
            store(answer + BY_TRIAL * EIGHT, by_stress * inverse);
            store(answer + BY_STRAIN * EIGHT, slope(STRAIN) * inverse);
            store(answer + BY_TIME * EIGHT, slope(TIME) * inverse);
            store(answer + BY_TEMPERATURE * EIGHT, slope(TEMPERATURE) * inverse);
            store(answer + BY_LOG_WEIGHT * EIGHT, increments[v] * inverse);
            store(answer + BY_PRINCIPAL * EIGHT, slope(PRINCIPAL_STRESS) * inverse);
            store(answer + BY_MEAN * EIGHT, slope(MEAN_STRESS) * inverse);
            for (int64_t c = 0; c < law.parameters; ++c)
                store(answer + (INPUTS + c) * EIGHT, slope(POINT_SIZE + c) * inverse);
        }
        if (states == 0) return;
        const int64_t outputs = unknowns * (1 + POINT_SIZE + states + law.parameters);
        double gradient[(1 + MAX_STATES) * (POINT_SIZE + MAX_STATES)], matrix[(1 + MAX_STATES) * (1 + MAX_STATES)];
        for (int lane = 0; lane < EIGHT; ++lane) {
            for (int64_t c = 0; c < outputs; ++c) point_output[c] = law_output[c * EIGHT + lane];
            const PointPredictor p(predictors, lane);
            const double creep = increments[lane / LANES][lane % LANES];
            const Axes axes = {p.mean, p.top, p.mean, 0.0};
            const StageProblem problem = {p.stiffness * p.equivalent, p.stiffness, 0.0, stage.weight,
                                          history[EQUIVALENT_STRAIN * EIGHT + lane]};
            gradient_of_sensitivity(point_output, problem, creep, gradient, states);
            const int64_t first = unknowns * (1 + POINT_SIZE + states);
            for (int64_t r = 0; r < unknowns; ++r)
                for (int64_t c = 0; c < law.parameters; ++c)
                    point_response[r * width + INPUTS + states + c] =
                        creep > 0.0 || r > 0 ? stage.weight * point_output[first + r * law.parameters + c] : 0.0;
            const bool regular = differentiate_stage(axes, problem, creep, law_input[STRESS * EIGHT + lane],
                                                     point_output + 1, gradient, matrix, point_response, states,
                                                     law.parameters);
            for (int64_t c = 0; c < unknowns * width; ++c)
                response[c * EIGHT + lane] = regular ? point_response[c] : 0.0;
        }
    }

    // Changes of D and of the states of a point at fixed strain, into `own`, (unknowns, padded).
    //
    // mean, mises : mean and von Mises stress of the point, MPa, both in proportion to the modulus.
    CREEPKIT_INLINE void set_own_changes(const PointLaw& law, double mean, double mises, const PointStates& points,
                                         int64_t point, int lane, int i, double h, const Tableau& tableau) {
        const int64_t states = law.states, unknowns = 1 + states, width = INPUTS + states + law.parameters;
        for (int64_t r = 0; r < unknowns; ++r) {
            const double* answer = response + r * width * EIGHT + lane;
            double* changes = own + (point * unknowns + r) * padded;
            const int64_t place = point * points.values * padded;
            for (int64_t block = 0; block < padded; block += LANES) {
                Vector total = answer[BY_STRAIN * EIGHT] *
                              history_change(place + EQUIVALENT_STRAIN * padded + block, i, h, tableau);
                for (int64_t z = 0; z < states; ++z)
                    total += answer[(INPUTS + z) * EIGHT] *
                             history_change(place + (EQUIVALENT_STRAIN + 1 + z) * padded + block, i, h, tableau);
                store(changes + block, total);
            }
            for (int64_t c = 0; c < law.parameters; ++c) changes[c] += answer[(INPUTS + states + c) * EIGHT];
            const int64_t count = directions.directions;
            const double stiffer = answer[BY_TRIAL * EIGHT] * mises +
                                   (answer[BY_MEAN * EIGHT] + answer[BY_PRINCIPAL * EIGHT]) * mean;
            for (int64_t d = 0; d < count; ++d)
                changes[law.parameters + d] += answer[BY_TIME * EIGHT] * inputs[BY_MOMENT * count + d] +
                                               answer[BY_TEMPERATURE * EIGHT] * inputs[BY_LOAD_TEMPERATURE * count + d] +
                                               answer[BY_LOG_WEIGHT * EIGHT] * inputs[BY_WEIGHT * count + d] +
                                               stiffer * inputs[BY_STIFFNESS * count + d];
        }
    }

    // Change of the stress P that forces are made of as the nodes move with geometry number `g` and keep their
    // displacements, volume and gradients of the shape included; added to changes[c * padded].
    CREEPKIT_INLINE void add_shape_change(const System& system, int64_t g, int64_t point, const Kinematics& at, int lane,
                                          const double piola[5][EIGHT], const double tangent[25][EIGHT], double scale,
                                          double* changes) const {
        const double* v = directions.gradients + (g * system.point_count() + point) * 4;
        const double hoop = directions.hoops[g * system.point_count() + point], grow = v[0] + v[3] + hoop;
        double F[5], P[5];
        shape_gradient_change(at, lane, v, hoop, F);
        for (int c = 0; c < 5; ++c) P[c] = piola[c][lane];
        const double moved[5] = {P[0] * grow - (P[0] * v[0] + P[1] * v[1]), P[1] * grow - (P[0] * v[2] + P[1] * v[3]),
                                 P[2] * grow - (P[2] * v[0] + P[3] * v[1]), P[3] * grow - (P[2] * v[2] + P[3] * v[3]),
                                 P[4] * (grow - hoop)};
        for (int c = 0; c < 5; ++c) {
            double total = scale * moved[c];  // the tangent carries its weight already
            for (int j = 0; j < 5; ++j) total += tangent[5 * c + j][lane] * F[j];
            changes[c * padded] += total;
        }
    }

    // Change of F of a point with the geometry: -(F - 1) grad V.
    CREEPKIT_INLINE static void shape_gradient_change(const Kinematics& at, int lane, const double* v, double hoop,
                                                      double F[5]) {
        const int l = lane % LANES;
        const double h11 = at.f11[l] - 1.0, h12 = at.f12[l], h21 = at.f21[l], h22 = at.f22[l] - 1.0;
        F[0] = -(h11 * v[0] + h12 * v[2]);
        F[1] = -(h11 * v[1] + h12 * v[3]);
        F[2] = -(h21 * v[0] + h22 * v[2]);
        F[3] = -(h21 * v[1] + h22 * v[3]);
        F[4] = -(at.f33[l] - 1.0) * hoop;
    }

    // Changes of the slopes of stage `i`, now that the changes of the displacements are known.
    void differentiate_slopes(System& system, const PointLaw& law, const PointStates& points, const StageConditions& stage,
                              const double* u, int i, double h, const Tableau& tableau) {
        const int64_t unknowns = 1 + law.states, values = points.values;
        const int64_t first_geometry = law.parameters + directions.directions;
        const double share = tableau.a[i][i] * h, inverse = 1.0 / share;
        alignas(64) double history[(EQUIVALENT_STRAIN + 1 + MAX_STATES) * EIGHT], by_strain[4][5][EIGHT];
        alignas(64) double normal[3][EIGHT], shares[EIGHT];  // w/e, D/e
        double* gradients = stress_change;  // (8, 5, padded), now changes of F
        for (int64_t k = 0; k < points.count; k += EIGHT) {
            Kinematics at[VECTORS];
            stage_history(points, k, i, h, tableau, history);
            system_memory.gradient_changes(system, k / EIGHT, gradients, padded);
            for (int v = 0; v < VECTORS; ++v) {
                const int first = v * LANES;
                ElasticPredictor p;
                Vector increment;
                set_points(system, points, stage, u, i, share, k + first, history, at[v], p, increment);
                set_strain_matrix(at[v], by_strain[0][0] + first);
                store(normal[0] + first, p.hoop * p.inverse);
                store(normal[1] + first, p.difference * p.inverse);
                store(normal[2] + first, p.shear * p.inverse);
                store(shares + first, increment * p.inverse);
            }
            for (int lane = 0; lane < EIGHT; ++lane) {
                const int64_t point = k + lane;
                double* F = gradients + lane * 5 * padded;
                for (int64_t g = 0; g < directions.geometries; ++g) {
                    const double* v = directions.gradients + (g * system.point_count() + point) * 4;
                    double shift[5];
                    shape_gradient_change(at[lane / LANES], lane, v, directions.hoops[g * system.point_count() + point],
                                          shift);
                    for (int c = 0; c < 5; ++c) F[c * padded + first_geometry + g] += shift[c];
                }
                const double n0 = normal[0][lane], n1 = normal[1][lane], n2 = normal[2][lane], left = shares[lane];
                const double* along = follow + point * unknowns * 4;
                const int64_t place = point * values * padded;
                for (int64_t block = 0; block < padded; block += LANES) {
                    Vector strain[4];
                    for (int a = 0; a < 4; ++a) {
                        strain[a] = Vector{};
                        for (int c = 0; c < 5; ++c) strain[a] += by_strain[a][c][lane] * load(F + c * padded + block);
                    }
                    const Vector trace = strain[SUM] + strain[HOOP];
                    const auto base = [&](int64_t v) {
                        return history_change(place + v * padded + block, i, h, tableau);
                    };
                    const Vector w0 = strain[HOOP] - trace * (1.0 / 3.0) - base(0), w1 = strain[DIFFERENCE] - base(1);
                    const Vector w2 = strain[SHEAR] - base(2);
                    const auto total = [&](int64_t r) {
                        return load(own + (point * unknowns + r) * padded + block) + along[4 * r] * w0 +
                               along[4 * r + 1] * w1 + along[4 * r + 2] * w2 + along[4 * r + 3] * trace;
                    };
                    const Vector creep = total(0), stretched = n0 * w0 + (1.0 / 3.0) * (n1 * w1 + n2 * w2);
                    double* slopes = rates[i] + place + block;
                    store(slopes, inverse * (creep * n0 + left * (w0 - n0 * stretched)));
                    store(slopes + padded, inverse * (creep * n1 + left * (w1 - n1 * stretched)));
                    store(slopes + 2 * padded, inverse * (creep * n2 + left * (w2 - n2 * stretched)));
                    store(slopes + EQUIVALENT_STRAIN * padded, inverse * creep);
                    for (int64_t z = 1; z < unknowns; ++z)
                        store(slopes + (EQUIVALENT_STRAIN + z) * padded,
                              inverse * (total(z) - base(EQUIVALENT_STRAIN + z)));
                }
            }
        }
    }

    // Derivatives (4, 5) of the strains to F, in rows of eight numbers, of which the points of the vector are the first.
    static void set_strain_matrix(const Kinematics& at, double* matrix) {
        const Vector *strains[4] = {at.by_sum, at.by_difference, nullptr, at.by_shear}, zero{};
        for (int a = 0; a < 4; ++a) {
            Vector by_alpha[4] = {zero, zero, zero, at.by_hoop}, by_gradient[5];
            if (a != HOOP) {
                for (int j = 0; j < 3; ++j) by_alpha[j] = strains[a][j];
                by_alpha[3] = zero;
            }
            to_gradient(at, by_alpha, by_gradient);
            for (int c = 0; c < 5; ++c) store(matrix + (5 * a + c) * EIGHT, by_gradient[c]);
        }
    }
};

}  // namespace creepkit
