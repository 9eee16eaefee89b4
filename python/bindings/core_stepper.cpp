// Single substeps from Python, forward, reverse and tangents, of batches in lanes. A state is a row (x, x_before, v, v_before, substep, impact): four
// times dofs numbers, and two whole ones without derivatives: which substep it is after, and how many of BDF1 an impact has left before it. Shapes:
// states (B, width), inputs (B, total).
#include "adjoint/rollout/single_step.h"

#include <algorithm>
#include <map>
#include <mutex>

#include "core/scalar/dual.h"
#include "python/bindings/solver.h"

namespace sheetbend::bindings {
namespace {

class Stepper {
 public:
  // `held`: motions whose first knot holds at all times.
  Stepper(const Solver& solver, const std::vector<std::string>& held)
      : solver_{std::make_shared<Scene>(*solver.scene), solver.plan} {
    for (const std::string& name : held) knots(name).times.resize(1);
  }

  std::size_t dofs() const { return solver_.scene->dofs(); }
  std::size_t width() const { return 4 * dofs() + 2; }
  std::size_t total() const { return solver_.scene->layout.total(); }

  py::array_t<double> step(const Array& states, const Array& inputs) {
    const std::size_t batch = check(states, inputs);
    auto out = empty({batch, width()});
    double* next = out.mutable_data();
    each(states.data(), batch, [&]<class T>(const Rows<T>& rows) {
      const auto in = rows.read(inputs.data(), total(), total()), state = rows.read(states.data(), 4 * dofs(), width());
      std::vector<T> to(4 * dofs());
      auto left = rows.impacts(states.data(), width());
      auto after_impact = std::bit_cast<AfterImpact<T>>(left);
      Borrowed<T> own(*this);
      own->forward(rows.substep, in.data(), state.data(), after_impact, to.data());
      left = std::bit_cast<decltype(left)>(after_impact);
      rows.write(to, next, width());
      for (int k = 0; k < rows.count; ++k) {
        double* row = next + rows.row[k] * width();
        row[width() - 2] = rows.substep + 1.0;
        row[width() - 1] = left[k];
      }
    });
    return out;
  }

  // Cotangents of the states and of the inputs, one after the other (B, width + total), of the substep from `states` to `next`.
  py::array_t<double> vjp(const Array& states, const Array& inputs, const Array& next, const Array& next_bar) const {
    const std::size_t batch = check(states, inputs);
    expect_size(next, batch * width(), "next");
    expect_size(next_bar, batch * width(), "next_bar");
    const std::size_t stride = width() + total();
    auto out = zeros({batch, stride});
    double* bars = out.mutable_data();
    const Solver& s = solver_;
    each(states.data(), batch, [&]<class T>(const Rows<T>& rows) {
      const auto in = rows.read(inputs.data(), total(), total()), state = rows.read(states.data(), 4 * dofs(), width());
      const auto end = rows.read(next.data(), 4 * dofs(), width());
      auto bar = rows.read(next_bar.data(), 4 * dofs(), width());
      std::vector<T> state_bar(4 * dofs()), in_bar(total());
      single_step_vjp<T>(*s.scene, s.plan, rows.substep, first_order(rows, states.data(), next.data()), in.data(),
                         state.data(), end.data(), bar.data(), state_bar.data(), in_bar.data());
      rows.write(state_bar, bars, stride);
      rows.write(in_bar, bars + width(), stride);
    });
    return out;
  }

  // Tangents (B, width) along (states_dot, inputs_dot).
  py::array_t<double> jvp(const Array& states, const Array& inputs, const Array& states_dot,
                          const Array& inputs_dot) const {
    using One = Dual<double, 1>;
    const std::size_t batch = check(states, inputs);
    expect_size(states_dot, batch * width(), "states_dot");
    expect_size(inputs_dot, batch * total(), "inputs_dot");
    auto out = zeros({batch, width()});
    double* next_dot = out.mutable_data();
    const auto duals = [](const double* values, const double* tangents, std::size_t size) {
      std::vector<One> all(values, values + size);
      for (std::size_t i = 0; i < size; ++i) all[i].d[0] = tangents[i];
      return all;
    };
    over_threads(solver_, batch, [&](int b, Interrupt*) {
      const double* row = states.data() + b * width();
      const auto in = duals(inputs.data() + b * total(), inputs_dot.data() + b * total(), total());
      const auto state = duals(row, states_dot.data() + b * width(), 4 * dofs());
      auto after_impact = std::bit_cast<AfterImpact<One>>(Rows<double>(0, *this, row).impacts(row, width()));
      std::vector<One> to(4 * dofs());
      SingleStep<One>(*solver_.scene, solver_.plan)
          .forward(substep_of(row), in.data(), state.data(), after_impact, to.data());
      for (std::size_t i = 0; i < to.size(); ++i) next_dot[b * width() + i] = to[i].d[0];
    });
    return out;
  }

 private:
  Knots& knots(const std::string& name) {
    Scene& s = *solver_.scene;
    if (name == "boundary") return s.boundary;
    if (name == "force") return s.force;
    if (name == "wind") return s.wind;
    if (name == "load") return s.load;
    throw std::invalid_argument("held: got '" + name + "'. Fix: name boundary, force, wind or load");
  }

  int substep_of(const double* row) const { return static_cast<int>(row[width() - 2]); }

  std::size_t check(const Array& states, const Array& inputs) const {
    const std::size_t batch = static_cast<std::size_t>(states.size()) / width();
    expect_size(states, batch * width(), "states");
    expect_size(inputs, batch * total(), "inputs");
    return batch;
  }

  // Rows of a batch that take a substep together: one, or up to eight at the same substep in the lanes of a pack; lanes left over repeat the first.
  template <class T>
  struct Rows {
    std::size_t row[scenes_of<T>];
    int count = 1;
    int substep;

    Rows(std::size_t first, const Stepper& s, const double* state) : substep(s.substep_of(state)) {
      std::ranges::fill(row, first);
    }

    std::vector<T> read(const double* data, std::size_t size, std::size_t stride) const {
      if constexpr (std::is_same_v<T, double>) {
        return {data + row[0] * stride, data + row[0] * stride + size};
      } else {
        std::vector<T> lanes(size);
        for (int k = 0; k < Pack::lanes; ++k)
          for (std::size_t i = 0; i < size; ++i) lanes[i].set(k, data[row[k] * stride + i]);
        return lanes;
      }
    }
    void write(const std::vector<T>& lanes, double* data, std::size_t stride) const {
      for (int k = 0; k < count; ++k)
        for (std::size_t i = 0; i < lanes.size(); ++i) {
          if constexpr (std::is_same_v<T, double>)
            data[row[k] * stride + i] = lanes[i];
          else
            data[row[k] * stride + i] = lanes[i][k];
        }
    }
    std::array<unsigned char, scenes_of<T>> impacts(const double* states, std::size_t stride) const {
      std::array<unsigned char, scenes_of<T>> left{};
      for (int k = 0; k < scenes_of<T>; ++k) left[k] = static_cast<unsigned char>(states[(row[k] + 1) * stride - 1]);
      return left;
    }
  };

  // Calls f(rows) for all rows of a batch, over the solver's threads. Where the formula changes at contacts each row goes alone, since its reverse does.
  template <class F>
  void each(const double* states, std::size_t batch, F&& f) const {
    if (batch == 1) {
      Release release;
      return f(Rows<double>(0, *this, states));
    }
    if (changes_at_contacts(*solver_.scene, solver_.plan.options))
      return over_threads(solver_, batch, [&](int b, Interrupt*) { f(Rows<double>(b, *this, states + b * width())); });
    std::map<int, std::vector<Rows<Pack>>> packs;
    for (std::size_t b = 0; b < batch; ++b) {
      const double* row = states + b * width();
      auto& own = packs[substep_of(row)];
      if (own.empty() || own.back().count == Pack::lanes)
        own.emplace_back(b, *this, row);
      else
        own.back().row[own.back().count++] = b;
    }
    std::vector<Rows<Pack>> all;
    for (auto& [substep, own] : packs) all.insert(all.end(), own.begin(), own.end());
    over_threads(solver_, all.size(), [&](int p, Interrupt*) { f(all[p]); });
  }

  // A substep to which an impact has left some, or in which a contact began, which leaves two more, goes with BDF1.
  template <class T>
  Scenes first_order(const Rows<T>& rows, const double* states, const double* next) const {
    const bool first = solver_.plan.options.integrator == Integrator::bdf1 || rows.substep == 0 ||
                       rows.impacts(states, width())[0] > 0 || rows.impacts(next, width())[0] == 2;
    return first ? all_scenes<T> : Scenes{0};
  }

  // What steps a scene, or eight of them: made when a thread needs one more, and kept.
  template <class T>
  struct Borrowed {
    Stepper& from;
    std::unique_ptr<SingleStep<T>> own;

    explicit Borrowed(Stepper& stepper) : from(stepper) {
      const std::lock_guard lock(from.mutex_);
      auto& spare = std::get<Spare<T>>(from.spare_);
      if (spare.empty()) {
        own = std::make_unique<SingleStep<T>>(*from.solver_.scene, from.solver_.plan);
      } else {
        own = std::move(spare.back());
        spare.pop_back();
      }
    }
    // One that threw is dropped: what it holds is not to be used.
    ~Borrowed() {
      if (std::uncaught_exceptions() > 0) return;
      const std::lock_guard lock(from.mutex_);
      std::get<Spare<T>>(from.spare_).push_back(std::move(own));
    }
    SingleStep<T>* operator->() const { return own.get(); }
  };
  template <class T>
  using Spare = std::vector<std::unique_ptr<SingleStep<T>>>;

  Solver solver_;
  std::mutex mutex_;
  std::tuple<Spare<double>, Spare<Pack>> spare_;
};

}  // namespace

void bind_stepper(py::module_& m) {
  py::class_<Stepper>(m, "Stepper")
      .def(py::init<const Solver&, const std::vector<std::string>&>(), py::arg("solver"),
           py::arg("held") = std::vector<std::string>())
      .def_property_readonly("width", &Stepper::width)
      .def("step", &Stepper::step, py::arg("states"), py::arg("inputs"))
      .def("vjp", &Stepper::vjp, py::arg("states"), py::arg("inputs"), py::arg("next"), py::arg("next_bar"))
      .def("jvp", &Stepper::jvp, py::arg("states"), py::arg("inputs"), py::arg("states_dot"), py::arg("inputs_dot"));
}

}  // namespace sheetbend::bindings
