// The kernels of potential_kernels.h for one kind's runs.
#pragma once

#include "core/blocks/potential_kernels.h"
#include "core/blocks/wide.h"
#include "core/element/second_order.h"

namespace sheetbend {

// lambda = -(C + g (C - C_r))/a of a pack of members; returns twice their energies.
template <class K>
Pack multipliers(const sheetbend_blocks::Potential& b, const sheetbend_blocks::Run& r, int n, const Element<K, Pack>& e,
                 const Pack* C, Pack* lambda) {
  const int* rows = indices_of<double>(r.first_row, 1, n);
  const Pack inverse = Pack(1.0) / e.rates.a, none[K::rows]{};
  Pack C_r[K::rows], energy(0.0);
  if (r.damped)
    for (int j = 0; j < K::rows; ++j) C_r[j] = gather(b.C_r, rows, j);
  for (int j = 0; j < K::rows; ++j) {
    const Pack residual = e.residual(C, none, r.damped ? C_r : nullptr, j);
    lambda[j] = -(residual * inverse);
    energy -= lambda[j] * (residual * e.rates.scale);
  }
  return energy;
}

// 1/D
template <class K>
Pack stiffness_of(const Element<K, Pack>& e) {
  return Pack(1.0) / (e.rates.a * e.rates.scale);
}

template <class K>
double evaluate_potential_of_run(const sheetbend_blocks::Potential& b, const sheetbend_blocks::Run& r) {
  Pack whole(0.0);
  double rest = 0.0;
  for (int n = 0; n < elements<double>(r); ++n) {
    const int *nodes = indices_of<double>(r.nodes, K::arity, n), members = r.count - n * Pack::lanes;
    const auto e = load_element<K, double>(b.x, r, nodes, n);
    const Evaluation<K, Pack> value(e.x, e.p);
    Pack lambda[K::rows];
    const Pack energy = multipliers(b, r, n, e, value.C, lambda), k = stiffness_of(e);
    Pack force[K::dofs], size[K::dofs], stiffness[K::dofs];
    unrolled<K::dofs>([&](auto d) {
      Pack push(0.0), sum(0.0), square(0.0);
      for (int j = 0; j < K::rows; ++j) {
        const Pack& J = value.J[j * K::dofs + d];
        const Pack term = J * lambda[j];
        push += term;
        sum += magnitude(term);
        square += J * J;
      }
      force[d] = push;
      size[d] = sum;
      stiffness[d] = square * k;
    });
    add_to_particles<K::arity>(b.force, nodes, members, force);
    add_to_particles<K::arity>(b.magnitude, nodes, members, size);
    add_to_particles<K::arity>(b.stiffness, nodes, members, stiffness);
    if (members >= Pack::lanes)
      whole += energy;
    else
      for (int lane = 0; lane < members; ++lane) rest += energy[lane];
  }
  for (int lane = 0; lane < Pack::lanes; ++lane) rest += whole[lane];
  return rest;
}

template <class K>
void find_elements_of_run(const sheetbend_blocks::Potential& b, const sheetbend_blocks::Run& r, double* elements_) {
  Pack* E = numbers_of<Pack>(elements_);
  for (int n = 0; n < elements<double>(r); ++n, E += triangle(K::dofs)) {
    const auto e = load_element<K, double>(b.x, r, indices_of<double>(r.nodes, K::arity, n), n);
    const SecondOrder<K, Pack> value(e.x, e.p);
    Pack lambda[K::rows];
    multipliers(b, r, n, e, value.C, lambda);
    const Pack stiffness = stiffness_of(e);
    for (int i = 0; i < triangle(K::dofs); ++i) E[i] = Pack(0.0);
    for (Pack& l : lambda) l = -l;
    value.add_hessian(lambda, E);
    for (int i = 0; i < K::dofs; ++i) {
      Pack kJ[K::rows];
      for (int j = 0; j < K::rows; ++j) kJ[j] = stiffness * value.J[j * K::dofs + i];
      for (int k = 0; k <= i; ++k) {
        Pack sum = kJ[0] * value.J[k];
        for (int j = 1; j < K::rows; ++j) sum += kJ[j] * value.J[j * K::dofs + k];
        E[triangle(i) + k] += sum;
      }
    }
  }
}

template <class K>
void multiply_elements_of_run(const sheetbend_blocks::Run& r, const double* elements_, const double* z, double* Ez) {
  const Pack* E = numbers_of<Pack>(elements_);
  for (int n = 0; n < elements<double>(r); ++n, E += triangle(K::dofs)) {
    const int* nodes = indices_of<double>(r.nodes, K::arity, n);
    Pack own[K::dofs], product[K::dofs]{}, unused;
    for (int k = 0; k < K::arity; ++k) load_particle(z, nodes + k * Pack::lanes, own + 3 * k, unused);
    for (int i = 0; i < K::dofs; ++i) {
      const Pack* row = E + triangle(i);
      for (int k = 0; k < i; ++k) {
        product[i] += row[k] * own[k];
        product[k] += row[k] * own[i];
      }
      product[i] += row[i] * own[i];
    }
    add_to_particles<K::arity>(Ez, nodes, r.count - n * Pack::lanes, product);
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
