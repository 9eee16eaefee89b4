// How residuals respond to the numbers b of a correction, A = dr/db, in segments of time. What earlier numbers do to later residuals goes through the
// scene's state, and there it spans few directions. With c_j its coordinates along them where segment j begins, and b_j the numbers that begin to act
// in that segment,
//
//   r_j = G_j [c_j; b_j],      c_{j+1} = R_j [c_j; b_j],      c_0 empty,
//
// so that A takes memory in proportion to the length of a motion, where as a dense matrix it takes its square.
#pragma once

#include <Eigen/Cholesky>
#include <utility>
#include <vector>

namespace sheetbend {

struct Response {
  struct Segment {
    std::vector<int> numbers;  // the places in b of b_j
    int first_row = 0;         // of r_j; rows of no segment are zero
    Eigen::MatrixXd G, R;      // R has no rows in the last segment
  };
  int rows = 0, numbers = 0;
  std::vector<Segment> segments;

  Eigen::MatrixXd times(const Eigen::MatrixXd& b) const;       // A b
  Eigen::MatrixXd transposed(const Eigen::MatrixXd& r) const;  // A^T r
};

// Factors of A^T A + weight: each segment's numbers are eliminated, from the last one on, and leave a quadratic form in c_j (the Riccati recursion of
// linear-quadratic control: Anderson & Moore 1990, Optimal Control, chapter 2).
class ResponseFactor {
 public:
  ResponseFactor() = default;
  explicit ResponseFactor(const Response& A, double weight = 1.0);

  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;
  double inverse_trace() const;  // of (A^T A + weight)^-1

 private:
  struct Segment {
    std::vector<int> numbers;
    Eigen::MatrixXd R, coupling;  // of b_j with c_j
    Eigen::LLT<Eigen::MatrixXd> own;
  };
  std::vector<Segment> segments_;
};

}  // namespace sheetbend
