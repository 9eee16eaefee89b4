// A response in segments against the dense matrix that it stands for.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <numeric>
#include <random>

#include "adjoint/fit/response.h"

namespace sheetbend {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd random(std::mt19937& generator, Index rows, Index columns) {
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(generator); });
}

// Numbers out of order, a first row that nothing moves, a segment without rows, one into which nothing is carried.
Response chain() {
  std::mt19937 generator(7);
  const int own[] = {5, 3, 4, 2}, carried[] = {0, 3, 0, 2, 0}, rows[] = {6, 0, 7, 5};
  Response A{1 + 6 + 7 + 5, 5 + 3 + 4 + 2, {}};
  std::vector<int> order(A.numbers);
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), generator);
  int row = 1, first = 0;
  for (int j = 0; j < 4; ++j) {
    Response::Segment s;
    s.numbers.assign(order.begin() + first, order.begin() + first + own[j]);
    s.first_row = row;
    s.G = random(generator, rows[j], carried[j] + own[j]);
    s.R = random(generator, carried[j + 1], carried[j] + own[j]);
    A.segments.push_back(s);
    first += own[j];
    row += rows[j];
  }
  return A;
}

TEST(Response, ProductsAreTransposesOfEachOther) {
  const Response A = chain();
  const MatrixXd dense = A.times(MatrixXd::Identity(A.numbers, A.numbers));
  EXPECT_TRUE(dense.row(0).isZero(0.0));
  EXPECT_GT(dense.bottomRows(18).rowwise().norm().minCoeff(), 0.0);
  EXPECT_LT((A.transposed(MatrixXd::Identity(A.rows, A.rows)) - dense.transpose()).norm(), 1e-13 * dense.norm());
}

TEST(Response, WhatComesFirstActsOnWhatFollows) {
  Response A = chain();
  const MatrixXd dense = A.times(MatrixXd::Identity(A.numbers, A.numbers));
  const auto& first = A.segments[0].numbers;
  const auto& last = A.segments[3].numbers;
  EXPECT_TRUE(MatrixXd(dense(Eigen::seq(1, 6), last)).isZero(0.0));
  EXPECT_TRUE(MatrixXd(dense(Eigen::seq(14, 18), first)).isZero(0.0));  // nothing is carried into the third segment
  EXPECT_GT(MatrixXd(dense(Eigen::seq(14, 18), A.segments[2].numbers)).norm(), 1.0);
}

TEST(Response, FactorsSolveAndTellTheTrace) {
  const Response A = chain();
  const MatrixXd identity = MatrixXd::Identity(A.numbers, A.numbers), dense = A.times(identity);
  const MatrixXd inverse = (dense.transpose() * dense + identity).inverse();
  const ResponseFactor factor(A);
  EXPECT_LT((factor.solve(identity) - inverse).norm(), 1e-12 * inverse.norm());
  EXPECT_NEAR(factor.inverse_trace(), inverse.trace(), 1e-12 * inverse.trace());
}

}  // namespace
}  // namespace sheetbend
