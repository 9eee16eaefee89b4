#include "adjoint/fit/response.h"

namespace sheetbend {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

Index count(const std::vector<int>& numbers) { return static_cast<Index>(numbers.size()); }

// c above the rows `numbers` of b.
MatrixXd stacked(const MatrixXd& c, const MatrixXd& b, const std::vector<int>& numbers) {
  MatrixXd z(c.rows() + count(numbers), b.cols());
  z << c, b(numbers, Eigen::all);
  return z;
}

}  // namespace

MatrixXd Response::times(const MatrixXd& b) const {
  MatrixXd r = MatrixXd::Zero(rows, b.cols()), c(0, b.cols());
  for (const Segment& s : segments) {
    const MatrixXd z = stacked(c, b, s.numbers);
    r.middleRows(s.first_row, s.G.rows()) = s.G * z;
    c = s.R * z;
  }
  return r;
}

MatrixXd Response::transposed(const MatrixXd& r) const {
  MatrixXd b = MatrixXd::Zero(numbers, r.cols()), c(0, r.cols());
  for (auto s = segments.rbegin(); s != segments.rend(); ++s) {
    const MatrixXd z = s->G.transpose() * r.middleRows(s->first_row, s->G.rows()) + s->R.transpose() * c;
    b(s->numbers, Eigen::all) = z.bottomRows(count(s->numbers));
    c = z.topRows(z.rows() - count(s->numbers));
  }
  return b;
}

ResponseFactor::ResponseFactor(const Response& A, double weight) : segments_(A.segments.size()) {
  MatrixXd after(0, 0);  // the quadratic form in the next segment's coordinates
  for (std::size_t j = segments_.size(); j-- > 0;) {
    const Response::Segment& s = A.segments[j];
    const Index own = count(s.numbers), carried = s.G.cols() - own;
    MatrixXd M = s.R.transpose() * after * s.R;
    M.selfadjointView<Eigen::Lower>().rankUpdate(s.G.transpose());
    M.diagonal().tail(own).array() += weight;
    Segment& factor = segments_[j];
    factor.numbers = s.numbers;
    factor.R = s.R;
    factor.coupling = M.bottomLeftCorner(own, carried);
    factor.own.compute(M.bottomRightCorner(own, own));
    const MatrixXd half = factor.own.matrixL().solve(factor.coupling);
    after = M.topLeftCorner(carried, carried).selfadjointView<Eigen::Lower>();
    after -= half.transpose() * half;
  }
}

MatrixXd ResponseFactor::solve(const MatrixXd& b) const {
  MatrixXd x(b.rows(), b.cols()), c(0, b.cols());
  for (auto s = segments_.rbegin(); s != segments_.rend(); ++s) {
    const Index own = count(s->numbers);
    MatrixXd z = s->R.transpose() * c;
    z.bottomRows(own) += b(s->numbers, Eigen::all);
    const MatrixXd half = s->own.solve(z.bottomRows(own));
    x(s->numbers, Eigen::all) = half;  // of which c_j's share is still to be taken away
    c = z.topRows(z.rows() - own) - s->coupling.transpose() * half;
  }
  c.resize(0, b.cols());
  for (const Segment& s : segments_) {
    x(s.numbers, Eigen::all) -= s.own.solve(s.coupling * c);
    c = s.R * stacked(c, x, s.numbers);
  }
  return x;
}

// b_j is -K_j c_j and something independent of covariance own^-1, so covariances go on from segment to segment.
double ResponseFactor::inverse_trace() const {
  double trace = 0.0;
  MatrixXd of_c(0, 0);
  for (const Segment& s : segments_) {
    const Index own = count(s.numbers), carried = of_c.rows();
    const MatrixXd K = s.own.solve(s.coupling);
    MatrixXd all(carried + own, carried + own);
    all.topLeftCorner(carried, carried) = of_c;
    all.bottomLeftCorner(own, carried) = -K * of_c;
    all.topRightCorner(carried, own) = all.bottomLeftCorner(own, carried).transpose();
    all.bottomRightCorner(own, own) = K * of_c * K.transpose() + s.own.solve(MatrixXd::Identity(own, own));
    trace += all.bottomRightCorner(own, own).trace();
    of_c = s.R * all * s.R.transpose();
  }
  return trace;
}

}  // namespace sheetbend
