// One recording and the scene that is to explain it: residuals of simulated against measured markers as a function of the parameters.
#pragma once

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "adjoint/equilibrium/equilibrium_tangents.h"
#include "adjoint/observe/cloud.h"
#include "adjoint/observe/estimated.h"
#include "adjoint/observe/force_sensor.h"
#include "adjoint/observe/markers.h"
#include "adjoint/observe/parameter_map.h"
#include "core/rollout/rollout.h"

namespace sheetbend {

enum class Start : int { given, equilibrium, settled };  // where a motion starts
enum class Loss : int { squares, soft_l1, huber, cauchy };

// Either markers, or the points of a cloud: then there are no markers but a shape, and a column holds another point in every frame.
struct Observations {
  std::vector<Marker> markers;
  std::size_t unplaced =
      0;             // points of a cloud: each has the inputs of an offset, as a marker has, and no use for them
  CloudShape shape;  // of a cloud
  std::vector<double> times;       // (frames) [s]
  std::vector<double> measured;    // (frames, columns, 3) [m], NaN = not seen; a column is a marker
  std::vector<double> sigma;       // (frames, columns) [m]: residuals are divided by it
  std::vector<int> axes{0, 1, 2};  // coordinates that count; of a cloud distances do
  Loss loss = Loss::squares;
  double loss_scale = 1.0;  // in units of sigma

  bool is_cloud() const { return shape.index() != 0; }
  std::size_t columns() const { return times.empty() ? 0 : sigma.size() / times.size(); }
  std::size_t rows_of_one() const {
    if (std::holds_alternative<ClothSurface>(shape)) return ClothSurface::rows;
    if (std::holds_alternative<RopeLines>(shape)) return RopeLines::rows;
    return axes.size();
  }
};

// A further rollout of the same motion at a shorter substep, for extrapolation in time, and the weight of its markers.
struct FinerRun {
  Plan plan;
  double weight;
};

// Parameters that make no sense, such as those that make a mass negative.
struct OutOfDomain : std::domain_error {
  using std::domain_error::domain_error;
};

// The inputs of an experiment are the scene's, then an offset (3) per marker [m], then the recording's time offset [s], then those of each
// force sensor.
struct Experiment {
  std::string name;
  std::shared_ptr<const Scene> scene;
  Plan plan;
  std::optional<Plan> settling;  // of a start that settles (settled.h)
  std::vector<FinerRun> finer;   // predicted markers are their weighted sum; those of `plan` weigh the rest up to 1
  ParameterMap map;
  std::vector<double> least, most;  // of the scene's inputs
  Observations observed;
  std::vector<ForceSensor> sensors;
  Estimated correction;
  bool is_static = false;  // the recording shows an equilibrium
  Start start = Start::given;
  double t0 = 0.0;
  EquilibriumOptions equilibrium;
  std::shared_ptr<EquilibriumAnchor> anchor = std::make_shared<EquilibriumAnchor>();

  std::size_t time_offset_at() const {
    return scene->layout.total() + 3 * (observed.markers.size() + observed.unplaced);
  }
  std::size_t inputs() const { return time_offset_at() + 1 + ForceSensor::inputs * sensors.size(); }
  // rows_of_one() per frame of every marker, or point of a cloud, that was seen, then those of the sensors
  std::size_t residual_count() const;
  std::size_t readings() const;  // six per sample of every sensor
  int steps() const { return steps(plan); }
  int steps(const Plan& run) const;  // substeps until the last frame and sample
  // The same where the sensors' clocks are shifted, by no more than the motion is long.
  template <class T>
  int steps_at(const Plan& run, const T* in) const;
  void check() const;
  [[noreturn]] void refuse(std::size_t input, double value) const;

  // The scene's inputs at parameters theta and a correction b (correction.count()), then the observation's. Throws OutOfDomain.
  template <class T>
  std::vector<T> inputs_at(const T* theta, const T* b) const {
    std::vector<T> in(inputs());
    map.apply(theta, in.data());
    for (std::size_t i = 0; i < least.size(); ++i)
      if (!(value_of(in[i]) >= least[i] && value_of(in[i]) <= most[i])) refuse(i, value_of(in[i]));
    correction.apply(b, in.data());
    return in;
  }

  // Fills, when not null, residuals (residual_count), simulated markers (frames, markers, 3) and readings of sensors (readings()).
  // Throws Diverged, Unconverged, NoEquilibrium or OutOfDomain.
  template <class T>
  void residuals(const T* theta, const T* b, T* r, T* simulated, T* sensed, Interrupt* interrupt) const;

 private:
  // Calls frame(number, coordinates at its time) for every frame of a rollout with that plan, and adds weight times what sensors read
  // to their means (readings); `in` as `inputs_at`.
  template <class T, class Frame>
  void run(const Plan& own, const T* in, Frame&& frame, double weight, T* means, Interrupt* interrupt) const;
  // Predicted markers (frames, markers, 3) of all runs together, or with a cloud coordinates (frames, dofs); means as in `run`.
  template <class T>
  std::vector<T> extrapolated(const T* in, T* means, Interrupt* interrupt) const;
};

}  // namespace sheetbend
