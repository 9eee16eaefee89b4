// The kernels over a scalar T that consists of many numbers.
#pragma once

#include <cstring>

#include "core/points/kernels.h"
#include "core/scalar/across.h"
#include "core/scalar/dual.h"
#include "core/scalar/pack.h"

namespace sheetbend {

// What a kernel computes with in the place of T: of a dual the value in every lane of a vector, and the directions in the lanes of another.
template <class T>
struct Held {
  using type = T;
  static T load(const T& a) { return a; }
  static void store(T& to, const T& a) { to = a; }
};
template <int N>
  requires(N > 1)
struct Held<Dual<double, N>> {
  using type = Dual<Lanes<N>, 1>;
  static type load(const Dual<double, N>& a) {
    type r{Lanes<N>(a.v)};
    std::memcpy(static_cast<void*>(r.d), a.d, sizeof a.d);
    return r;
  }
  static void store(Dual<double, N>& to, const type& a) {
    std::memcpy(to.d, static_cast<const void*>(a.d), sizeof to.d);
    to.v = a.v[0];
  }
};

template <class T>
struct PointKernels {
  using Points = sheetbend_points::Points;
  using S = typename Held<T>::type;

  static const T* at(const double* numbers, long i) { return reinterpret_cast<const T*>(numbers) + i; }
  static T* at(double* numbers, long i) { return reinterpret_cast<T*>(numbers) + i; }
  static S load(const double* numbers, long i) { return Held<T>::load(*at(numbers, i)); }
  static void store(double* numbers, long i, const S& a) { Held<T>::store(*at(numbers, i), a); }
  static Vec3<S> load_point(const double* numbers, long i) {
    return {load(numbers, i), load(numbers, i + 1), load(numbers, i + 2)};
  }
  static void store_point(double* numbers, long i, const Vec3<S>& p) {
    store(numbers, i, p.x);
    store(numbers, i + 1, p.y);
    store(numbers, i + 2, p.z);
  }

  static S history(const Points& p, const double* now, const double* before, long i) {
    return p.before == 0.0 ? load(now, i) : p.now * load(now, i) + p.before * load(before, i);
  }
  static S extrapolated(const Points& p, const double* now, const double* before, long i) {
    return p.extrapolate_now * load(now, i) + p.extrapolate_before * load(before, i);
  }

  static void effective_masses(const Points& p, int begin, int end) {
    const Vec3<S> wind = load_point(p.wind, 0);
    for (long n = begin; n < end; ++n) {
      if (!p.inertial[n]) continue;
      const auto v = [&](int d) { return extrapolated(p, p.v, p.v_before, 3 * n + d); };
      Vec3<S> velocity(v(0), v(1), v(2));
      if (p.has_weight[n]) velocity = velocity - wind;
      const S speed = sqrt_or_zero(dot(velocity, velocity)), mass = load(p.mass, n);
      const S effective = mass + p.eta * (load(p.drag_linear, n) + load(p.drag_quadratic, n) * speed);
      const S w = 1.0 / effective;
      store(p.w, n, w);
      store(p.kept, n, mass * w);
    }
  }

  static void predict(const Points& p, int begin, int end) {
    const Vec3<S> wind = load_point(p.wind, 0), gravity = p.eta * load_point(p.gravity, 0);
    const S carried[3] = {wind.x, wind.y, wind.z},
            added[3] = {gravity.x - wind.x, gravity.y - wind.y, gravity.z - wind.z};
    for (long n = begin; n < end; ++n)
      for (int d = 0; d < 3; ++d) {
        const long i = 3 * n + d;
        if (p.director[n]) {
          store(p.q, p.stride * n + d, extrapolated(p, p.x, p.x_before, i));
          continue;
        }
        S v = history(p, p.v, p.v_before, i) + added[d];
        if (p.kept) v = load(p.kept, n) * v + carried[d];
        store(p.q, p.stride * n + d, history(p, p.x, p.x_before, i) + p.eta * v);
      }
  }

  static bool update_velocities(const Points& p, int begin, int end) {
    const double rate = 1.0 / p.eta;
    S difference(0.0);  // q - q, which only what is finite has as zero
    for (long n = begin; n < end; ++n)
      for (int d = 0; d < 3; ++d) {
        const long i = 3 * n + d;
        const S now = load(p.q, p.stride * n + d);
        store(p.v_next, i, rate * (now - history(p, p.x, p.x_before, i)));
        store(p.x_next, i, now);
        difference += now - now;
      }
    return all_finite(difference);
  }

  static void retract(const sheetbend_points::Frame* frames, int count, double* x) {
    for (const auto* f = frames; f < frames + count; ++f) {
      const Vec3<S> q = load_point(x, f->director), head = load_point(x, f->head);
      if (f->head == f->director)
        store_point(x, f->director, (1.0 / norm(q)) * q);
      else
        store_point(x, f->director, Across<S>(f->tail < 0 ? head : head - load_point(x, f->tail), q).m1);
    }
  }

  static void interpolate(const double* values, long between, const double* weight, int knots, double* to) {
    for (int d = 0; d < 3; ++d) {
      S sum(0.0);
      for (int k = 0; k < knots; ++k) sum += weight[k] * load(values, between * k + d);
      store(to, d, sum);
    }
  }

  static constexpr sheetbend_points::Kernels all{&effective_masses, &predict, &update_velocities, &retract,
                                                 &interpolate};
};

}  // namespace sheetbend
