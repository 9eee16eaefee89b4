// The tangents (block_tangents.h) of one kind's runs in a direct block.
#pragma once

#include "core/blocks/wide.h"
#include "core/packs/tangent.h"

namespace sheetbend {

// One member's values, from packs of eight members.
template <class K>
struct MemberValues {
  const sheetbend_blocks::Run& run;
  const double* directions;
  int n, lane;
  Tangent operator[](int part) const {
    const int count = sheetbend_blocks::value_count(run.damped, parameter_count<K>);
    return tangent_at(run.values, directions, lane_at(n, count, part), lane);
  }
  void parameters(Tangent* p) const {
    for (int k = 0; k < parameter_count<K>; ++k) p[k] = (*this)[sheetbend_blocks::value_count(run.damped, 0) + k];
  }
};

template <class K>
void load_tangents(const double* rows, const double* directions, const int* nodes, int lane, Tangent* x) {
  unrolled<K::dofs>(
      [&](auto d) { x[d] = tangent_at(rows, directions, nodes[d / 3 * Pack::lanes] + long(d % 3), lane); });
}

// One member's share of the right side without J z', and of J'^T dl.
template <class K>
void tangents_of_member(const sheetbend_blocks::Block& b, const sheetbend_blocks::Tangents& t, int r, int n, int lane) {
  const sheetbend_blocks::Run& run = b.runs[r];
  const Place<Tangent> at(n);
  const int* nodes = at.indices(run.nodes, K::arity);
  const int row = *at.indices(run.first_row, 1);
  const MemberValues<K> values{run, t.values[r], n, lane};
  Element<K, Tangent> e;
  load_tangents<K>(b.x, t.x, nodes, lane, e.x);
  e.rates.a = values[0];
  if (run.damped) {
    e.rates.g = values[1];
    e.rates.scale = values[2];
  }
  values.parameters(e.p);
  const Evaluation<K, Tangent> value(e.x, e.p);
  double z[K::dofs];
  Register push[K::dofs];
  unrolled<K::dofs>([&](auto d) {
    const int particle = nodes[d / 3 * Pack::lanes];
    z[d] = b.x[particle + 3] * b.u[particle + d % 3];
    push[d] = Register(0.0);
  });
  unrolled<K::rows>([&](auto j) {
    Tangent lambda[K::rows], C_r[K::rows];
    lambda[j] = tangent_at(b.lambda, t.lambda, row + j, lane);
    if (run.damped) C_r[j] = tangent_at(b.C_r, t.C_r, row + j, lane);
    const Register dl(b.dl[row + j]);
    Register sum = -(e.residual(value.C, lambda, run.damped ? C_r : nullptr, j) * e.rates.scale).d[0] -
                   (e.rates.a * e.rates.scale).d[0] * dl;
    unrolled<K::dofs>([&](auto d) {
      sum -= value.J[j * K::dofs + d].d[0] * Register(z[d]);
      push[d] += value.J[j * K::dofs + d].d[0] * dl;
    });
    directions_at(t.dl, row + j, lane) = sum;
  });
  unrolled<K::dofs>([&](auto d) { directions_at(t.u, nodes[d / 3 * Pack::lanes] + long(d % 3), lane) += push[d]; });
}

template <class K>
void tangents_of_run(const sheetbend_blocks::Block& b, const sheetbend_blocks::Tangents& t, int r) {
  for (int n = 0; n < b.runs[r].count; ++n)
    for (int lane = 0; lane < Pack::lanes; lane += register_lanes) tangents_of_member<K>(b, t, r, n, lane);
}

// Whether C depends on its parameters by a factor and by what is subtracted alone, see concept.h.
template <class K>
inline constexpr bool has_plain_parameters = parameter_count<K> == K::factors + K::offsets;

// C' = J x' and what the parameters add. The gradients of a register's members are found at a time, with a factor as if it were one.
template <class K>
void values_tangents_by_gradient(const sheetbend_blocks::Values& b, const sheetbend_blocks::ValueTangents& t, int r) {
  const sheetbend_blocks::Run& run = b.runs[r];
  for (int n = 0; n < Place<double>::count(run); ++n) {
    const Place<double> at(n);
    const int* nodes = at.indices(run.nodes, K::arity);
    Register x[K::dofs], p[parameter_count<K> + 1];
    at.load_stencil<K::arity>(b.x, nodes, x);
    for (int k = 0; k < parameter_count<K>; ++k) p[k] = Register(k < K::factors ? 1.0 : 0.0);
    const Evaluation<K, Register> value(x, p);
    const auto *C = reinterpret_cast<const double*>(value.C), *J = reinterpret_cast<const double*>(value.J);
    for (int member = 0; member < at.members(run); ++member)
      for (int lane = 0; lane < Pack::lanes; lane += register_lanes) {
        const MemberValues<K> values{run, t.values[r], n * register_lanes + member, lane};
        Tangent own[parameter_count<K> + 1];
        values.parameters(own);
        unrolled<K::rows>([&](auto j) {
          Register sum(0.0);
          unrolled<K::dofs>([&](auto d) {
            sum += Register(J[(j * K::dofs + d) * register_lanes + member]) *
                   directions_at(t.x, nodes[d / 3 * Pack::lanes + member] + long(d % 3), lane);
          });
          if constexpr (K::factors > 0 && j == K::rows - 1)
            sum = own[0].v * sum + Register(C[j * register_lanes + member]) * own[0].d[0];
          if constexpr (j < K::offsets) sum -= own[K::factors + j].d[0];
          directions_at(t.C, at.indices(run.first_row, 1)[member] + j, lane) = sum;
        });
      }
  }
}

template <class K>
void values_tangents_on_duals(const sheetbend_blocks::Values& b, const sheetbend_blocks::ValueTangents& t, int r) {
  const sheetbend_blocks::Run& run = b.runs[r];
  for (int n = 0; n < run.count; ++n)
    for (int lane = 0; lane < Pack::lanes; lane += register_lanes) {
      const Place<Tangent> at(n);
      Tangent x[K::dofs], p[parameter_count<K> > 0 ? parameter_count<K> : 1];
      load_tangents<K>(b.x, t.x, at.indices(run.nodes, K::arity), lane, x);
      MemberValues<K>{run, t.values[r], n, lane}.parameters(p);
      const Evaluation<K, Tangent> value(x, p);
      const int row = *at.indices(run.first_row, 1);
      for (int j = 0; j < K::rows; ++j) directions_at(t.C, row + j, lane) = value.C[j].d[0];
    }
}

template <class K>
void values_tangents_of_run(const sheetbend_blocks::Values& b, const sheetbend_blocks::ValueTangents& t, int r) {
  if constexpr (has_plain_parameters<K>)
    values_tangents_by_gradient<K>(b, t, r);
  else
    values_tangents_on_duals<K>(b, t, r);
}

template <class K>
constexpr sheetbend_blocks::TangentsOfKind tangents_of_kind() {
  return {&tangents_of_run<K>, &values_tangents_of_run<K>};
}

}  // namespace sheetbend
