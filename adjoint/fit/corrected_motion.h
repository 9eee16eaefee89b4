// A motion at one correction. The gradient is one adjoint. The response is made of tangents, eight at a time, from segment to segment: the
// state that they have reached together is put in an orthonormal basis (QR with column pivoting), and only its directions go on, however many numbers
// came before (as in reduced-rank square root filters: Verlaan & Heemink 1997).
#pragma once

#include <algorithm>
#include <optional>

#include "adjoint/fit/corrected.h"
#include "adjoint/observe/settled.h"
#include "adjoint/rollout/rollout.h"

namespace sheetbend {

class CorrectedMotion : public Corrected {
 public:
  CorrectedMotion(const Experiment& e, const double* theta, const double* b, Interrupt* interrupt);

  std::vector<double> gradient(Interrupt* interrupt) override;
  Response response(double tolerance, int threads, Interrupt* interrupt) const override;

 private:
  // What becomes of directions between two substeps: first those that were carried to it, then numbers that begin to act.
  struct Stretch {
    int begin, end;                // substeps
    std::size_t frames[2];         // those that it compares, and one past the last
    std::vector<int> numbers, at;  // that begin to act, and the substeps from which they do
    std::vector<int> acting;       // numbers of before that still do
    std::vector<int> onward;       // and those that do after its end
  };
  // In which a state's directions count: how far a point is off, and with which velocity it would be in the time of a stretch.
  struct Unit {
    double place, velocity;
    double of(std::size_t part) const { return part < 2 ? place : velocity; }
  };
  // Directions `first` to first + width of a stretch.
  struct Directions {
    const Stretch& stretch;
    const Unit& unit;
    const Eigen::MatrixXd& carried;
    int first, width;

    int brought() const { return static_cast<int>(carried.cols()); }
    int from() const { return first < brought() ? stretch.begin : stretch.at[first - brought()]; }  // their substep
    template <class F>
    void each_brought(F&& body) const {
      for (int k = 0; k < std::min(width, brought() - first); ++k) body(k, carried.col(first + k));
    }
  };
  struct Acts {
    int from, until;  // substeps at which a number changes the motion's inputs
  };
  Acts acts(int number) const;
  std::vector<Stretch> stretches() const;
  std::vector<Dual<double, 8>> moved_numbers(const Directions& d) const;
  std::vector<Dual<double, 8>> moved_inputs(const Directions& d, const std::vector<Dual<double, 8>>& b,
                                            Interrupt* interrupt) const;
  void restart(const Directions& d, Rollout<Dual<double, 8>>& rollout) const;
  void march(const Directions& d, Eigen::MatrixXd& G, Eigen::MatrixXd& reached, Interrupt* interrupt) const;

  int last_;
  std::vector<double> start_;  // the inputs with the equilibrium or the settled places that the motion starts at
  std::vector<double> states_;
  std::vector<std::size_t> first_row_;  // of each frame
  std::optional<Equilibrium> rest_;
  std::optional<Settled> settled_;
  std::optional<Tape<double>> tape_;
};

}  // namespace sheetbend
