#include "core/linear/unsymmetric_factor.h"

#include <algorithm>
#include <stdexcept>

namespace sheetbend {
namespace {

std::size_t work_of(const FactorStructure& s) {
  const auto nodes = s.supernodes();
  return UnsymmetricSupernodalFactor::most_columns * static_cast<std::size_t>(nodes.widest + nodes.longest);
}

}  // namespace

void UnsymmetricFactor::resize(const FactorStructure& s) {
  const auto nodes = s.supernodes();
  for (int node = 0; node <= nodes.count; ++node)
    if (nodes.first[node] % 3 != 0) throw std::logic_error("a supernode ends within a particle");
  for (auto* panels : {&lower_, &upper_}) panels->resize(s.values());
  inverse_.resize(s.size());
  work_.resize(work_of(s));
  for (auto* places : {&from_, &place_}) places->resize(s.size());
}

std::size_t UnsymmetricFactor::bytes(const FactorStructure& s) {
  return sizeof(double) * (2 * s.values() + s.size() + work_of(s)) + 2 * sizeof(int) * s.size();
}

void UnsymmetricFactor::load(const FactorStructure& s, const double* values) {
  for (auto* panels : {&lower_, &upper_}) std::copy_n(values, s.values(), panels->data());
  const auto nodes = s.supernodes();
  for (int node = 0; node < nodes.count; ++node) {
    double* panel = &lower_[nodes.panel[node]];
    const long length = nodes.length[node];
    for (int c = 1; c < nodes.first[node + 1] - nodes.first[node]; ++c)
      for (int r = 0; r < c; ++r) panel[c * length + r] = panel[r * length + c];
  }
}

void UnsymmetricFactor::add(const FactorStructure& s, int row, int column, double scale, const double* block) {
  const bool above = row < column && !s.joins(row, column);
  const auto [first, last] = std::minmax(row, column);
  const std::size_t at = s.position(above ? last : std::max(row, column), above ? first : column);
  double* to = above ? &upper_[at] : &lower_[row < column ? at - (column - row) : at];
  const std::size_t length = s.column_length(first);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) to[above ? b + a * length : a + b * length] += scale * block[3 * a + b];
}

bool UnsymmetricFactor::factorize(const FactorStructure& s, sheetbend_blocks::FactorUnsymmetric* compiled) {
  const auto nodes = s.supernodes();
  if (compiled)
    return compiled(nodes, lower_.data(), upper_.data(), inverse_.data(), from_.data(), work_.data(), place_.data());
  return UnsymmetricSupernodalFactor{nodes,        lower_.data(), upper_.data(), inverse_.data(),
                                     from_.data(), work_.data(),  place_.data()}
      .factorize();
}

}  // namespace sheetbend
