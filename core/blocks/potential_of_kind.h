// The kernels of potential_kernels.h for one kind's runs.
#pragma once

#include "core/blocks/potential_kernels.h"
#include "core/blocks/wide.h"
#include "core/element/second_order.h"

namespace sheetbend {

// lambda = -(C + g (C - C_r)) / a of a place's members; returns twice their energies.
template <class K>
Register multipliers(const sheetbend_blocks::Potential& b, const sheetbend_blocks::Run& r, const Place<double>& at,
                     const Element<K, Register>& e, const Register* C, Register* lambda) {
  const int* rows = at.indices(r.first_row, 1);
  const Register inverse = Register(1.0) / e.rates.a, none[K::rows]{};
  Register C_r[K::rows], energy(0.0);
  if (r.damped)
    for (int j = 0; j < K::rows; ++j) C_r[j] = at.gather(b.C_r, rows, j);
  for (int j = 0; j < K::rows; ++j) {
    const Register residual = e.residual(C, none, r.damped ? C_r : nullptr, j);
    lambda[j] = -(residual * inverse);
    energy -= lambda[j] * (residual * e.rates.scale);
  }
  return energy;
}

// 1/D
template <class K>
Register stiffness_of(const Element<K, Register>& e) {
  return Register(1.0) / (e.rates.a * e.rates.scale);
}

template <class K>
double evaluate_potential_of_run(const sheetbend_blocks::Potential& b, const sheetbend_blocks::Run& r) {
  alignas(Pack) double whole[Pack::lanes]{};  // of the packs that are full, by lanes
  double rest = 0.0;
  for (int n = 0; n < Place<double>::count(r); ++n) {
    const Place<double> at(n);
    const int* nodes = at.indices(r.nodes, K::arity);
    const auto e = at.load_element<K>(b.x, r, nodes);
    const Evaluation<K, Register> value(e.x, e.p);
    Register lambda[K::rows];
    const Register energy = multipliers(b, r, at, e, value.C, lambda), k = stiffness_of(e);
    Register force[K::dofs], size[K::dofs], stiffness[K::dofs];
    unrolled<K::dofs>([&](auto d) {
      Register push(0.0), sum(0.0), square(0.0);
      for (int j = 0; j < K::rows; ++j) {
        const Register& J = value.J[j * K::dofs + d];
        const Register term = J * lambda[j];
        push += term;
        sum += magnitude(term);
        square += J * J;
      }
      force[d] = push;
      size[d] = sum;
      stiffness[d] = square * k;
    });
    at.add_to_stencil<K::arity>(b.force, nodes, r, force);
    at.add_to_stencil<K::arity>(b.magnitude, nodes, r, size);
    at.add_to_stencil<K::arity>(b.stiffness, nodes, r, stiffness);
    if ((pack_of(n) + 1) * Pack::lanes <= r.count)
      at.value(whole, 0, 0) += energy;
    else
      for (int lane = 0; lane < at.members(r); ++lane) rest += energy[lane];
  }
  for (double energy : whole) rest += energy;
  return rest;
}

template <class K>
void find_elements_of_run(const sheetbend_blocks::Potential& b, const sheetbend_blocks::Run& r, double* elements) {
  constexpr int numbers = triangle(K::dofs);
  for (int n = 0; n < Place<double>::count(r); ++n) {
    const Place<double> at(n);
    const auto e = at.load_element<K>(b.x, r, at.indices(r.nodes, K::arity));
    const SecondOrder<K, Register> value(e.x, e.p);
    Register lambda[K::rows], E[numbers];
    multipliers(b, r, at, e, value.C, lambda);
    const Register stiffness = stiffness_of(e);
    for (Register& entry : E) entry = Register(0.0);
    for (Register& l : lambda) l = -l;
    value.add_hessian(lambda, E);
    for (int i = 0; i < K::dofs; ++i) {
      Register kJ[K::rows];
      for (int j = 0; j < K::rows; ++j) kJ[j] = stiffness * value.J[j * K::dofs + i];
      for (int k = 0; k <= i; ++k) {
        Register sum = kJ[0] * value.J[k];
        for (int j = 1; j < K::rows; ++j) sum += kJ[j] * value.J[j * K::dofs + k];
        at.value(elements, numbers, triangle(i) + k) = E[triangle(i) + k] + sum;
      }
    }
  }
}

template <class K>
void multiply_elements_of_run(const sheetbend_blocks::Run& r, const double* elements, const double* z, double* Ez) {
  for (int n = 0; n < Place<double>::count(r); ++n) {
    const Place<double> at(n);
    const int* nodes = at.indices(r.nodes, K::arity);
    const auto E = [&](int i, int k) { return at.value(elements, triangle(K::dofs), triangle(i) + k); };
    Register own[K::dofs], product[K::dofs]{};
    at.load_stencil<K::arity>(z, nodes, own);
    for (int i = 0; i < K::dofs; ++i) {
      for (int k = 0; k < i; ++k) {
        product[i] += E(i, k) * own[k];
        product[k] += E(i, k) * own[i];
      }
      product[i] += E(i, i) * own[i];
    }
    at.add_to_stencil<K::arity>(Ez, nodes, r, product);
  }
}

template <class K>
constexpr sheetbend_blocks::PotentialOfKind potential_of_kind() {
  if constexpr (balances<K>)
    return {&evaluate_potential_of_run<K>, &find_elements_of_run<K>, &multiply_elements_of_run<K>};
  else
    return {};  // plan.cpp refuses it
}

}  // namespace sheetbend
