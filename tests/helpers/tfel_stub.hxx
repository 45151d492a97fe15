// The few tensors of TFEL that an exported @Integrator uses, written for tests: symmetric tensors as six numbers,
// with the shear components times the square root of 2, so that double contraction is the scalar product.
#pragma once
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

using namespace std;
using real = double;
using stress = double;

namespace tfel {
namespace math {
template <unsigned n, typename T>
struct tvector {
  T v[n] = {};
  T& operator[](int i) { return v[i]; }
  const T& operator[](int i) const { return v[i]; }
};
template <unsigned n, unsigned m, typename T>
struct tmatrix {
  T v[n][m] = {};
  T& operator()(int i, int j) { return v[i][j]; }
  const T& operator()(int i, int j) const { return v[i][j]; }
};
}  // namespace math
}  // namespace tfel

struct Stensor {
  double v[6] = {};
  double& operator()(int i) { return v[i]; }
  double operator()(int i) const { return v[i]; }
  static Stensor Id() { return {{1, 1, 1, 0, 0, 0}}; }
  Stensor& operator+=(const Stensor& b) {
    for (int i = 0; i != 6; ++i) v[i] += b.v[i];
    return *this;
  }
  // cyclic Jacobi rotations
  void computeEigenVectors(tfel::math::tvector<3u, stress>& values, tfel::math::tmatrix<3u, 3u, real>& axes) const {
    const double r = 1 / sqrt(2.0);
    double a[3][3] = {{v[0], v[3] * r, v[4] * r}, {v[3] * r, v[1], v[5] * r}, {v[4] * r, v[5] * r, v[2]}};
    for (int i = 0; i != 3; ++i)
      for (int j = 0; j != 3; ++j) axes(i, j) = i == j;
    for (int sweep = 0; sweep != 30; ++sweep)
      for (const auto& [p, q] : {pair<int, int>{0, 1}, {0, 2}, {1, 2}}) {
        if (a[p][q] == 0) continue;
        const double angle = 0.5 * atan2(2 * a[p][q], a[q][q] - a[p][p]), c = cos(angle), s = sin(angle);
        for (int k = 0; k != 3; ++k) {
          const double x = a[k][p], y = a[k][q];
          a[k][p] = c * x - s * y, a[k][q] = s * x + c * y;
        }
        for (int k = 0; k != 3; ++k) {
          const double x = a[p][k], y = a[q][k];
          a[p][k] = c * x - s * y, a[q][k] = s * x + c * y;
        }
        for (int k = 0; k != 3; ++k) {
          const double x = axes(k, p), y = axes(k, q);
          axes(k, p) = c * x - s * y, axes(k, q) = s * x + c * y;
        }
      }
    for (int i = 0; i != 3; ++i) values[i] = a[i][i];
  }
  // the dyad of each axis
  static void computeEigenTensors(Stensor& a, Stensor& b, Stensor& c, const tfel::math::tmatrix<3u, 3u, real>& axes) {
    const double r = sqrt(2.0);
    int k = 0;
    for (Stensor* d : {&a, &b, &c}) {
      const double x = axes(0, k), y = axes(1, k), z = axes(2, k++);
      *d = {{x * x, y * y, z * z, r * x * y, r * x * z, r * y * z}};
    }
  }
};

struct Stensor4 {
  double v[6][6] = {};
  double& operator()(int i, int j) { return v[i][j]; }
  double operator()(int i, int j) const { return v[i][j]; }
  // seq^2 = sig : M : sig
  static Stensor4 M() {
    Stensor4 m;
    for (int i = 0; i != 6; ++i)
      for (int j = 0; j != 6; ++j) m(i, j) = 1.5 * (i == j) - (i < 3 && j < 3 ? 0.5 : 0);
    return m;
  }
  Stensor4& operator+=(const Stensor4& b) {
    for (int i = 0; i != 6; ++i)
      for (int j = 0; j != 6; ++j) v[i][j] += b(i, j);
    return *this;
  }
};

inline Stensor operator*(double k, Stensor a) {
  for (double& x : a.v) x *= k;
  return a;
}
inline Stensor operator*(const Stensor& a, double k) { return k * a; }
inline Stensor operator/(const Stensor& a, double k) { return (1 / k) * a; }
inline Stensor operator+(Stensor a, const Stensor& b) { return a += b; }
inline Stensor operator-(const Stensor& a, const Stensor& b) { return a + (-1) * b; }
inline Stensor4 operator*(double k, Stensor4 a) {
  for (auto& row : a.v)
    for (double& x : row) x *= k;
  return a;
}
inline Stensor4 operator-(Stensor4 a, const Stensor4& b) { return a += (-1) * b; }
inline Stensor4 operator^(const Stensor& a, const Stensor& b) {
  Stensor4 c;
  for (int i = 0; i != 6; ++i)
    for (int j = 0; j != 6; ++j) c(i, j) = a(i) * b(j);
  return c;
}
inline double trace(const Stensor& a) { return a(0) + a(1) + a(2); }
inline Stensor deviator(const Stensor& a) { return a - trace(a) / 3 * Stensor::Id(); }
inline double sigmaeq(const Stensor& a) {
  double sum = 0;
  for (double x : deviator(a).v) sum += x * x;
  return sqrt(1.5 * sum);
}
inline double computeMu(double young, double nu) { return young / (2 * (1 + nu)); }
inline double computeLambda(double young, double nu) { return young * nu / ((1 + nu) * (1 - 2 * nu)); }

// What the Implicit DSL and the brick StandardElasticity set before @Integrator: Hooke's law at t + theta dt, the split of
// the strain, and the identity as Jacobian.
using StrainStensor = Stensor;
using OutOfBoundsException = std::runtime_error;
inline double norm(double a) { return fabs(a); }
struct BehaviourData {
  double young, nu, theta, dt, T, dT, zeros = 0, delta_zeros = 0;
  int iter = 0, iterMax = 100;
  Stensor sig, feel, eel, deel;
  Stensor4 dfeel_ddeel;
  void start(const double* given, const double* unknown) {
    young = given[12], nu = given[13], theta = given[14], dt = given[15], T = given[16], dT = given[17];
    Stensor middle;
    for (int i = 0; i != 6; ++i) {
      deel(i) = unknown[i];
      eel(i) = given[i] + unknown[i];
      middle(i) = given[i] + theta * unknown[i];
      feel(i) = unknown[i] - given[6 + i];
      dfeel_ddeel(i, i) = 1;
    }
    sig = computeLambda(young, nu) * trace(middle) * Stensor::Id() + 2 * computeMu(young, nu) * middle;
  }
  void finish(double* residual) const {
    for (int i = 0; i != 6; ++i) residual[i] = feel(i);
  }
};
