// The bytes that a gradient is said to need against those that it allocates: this program counts every allocation.
#include <algorithm>
#include <cstdlib>
#include <new>

#include "adjoint/tape/footprint.h"
#include "adjoint/tape/tape_plan.h"
#include "core/scalar/dual.h"
#include "tests/cpp/support/bipyramid.h"
#include "tests/cpp/support/contact_scenes.h"
#include "tests/cpp/support/programs.h"

namespace {
std::size_t live = 0, peak = 0;

// The size stands in front of what is handed out.
void* counted(std::size_t size, std::size_t alignment) {
  char* block = static_cast<char*>(std::aligned_alloc(alignment, (size + 2 * alignment - 1) / alignment * alignment));
  if (!block) throw std::bad_alloc();
  char* p = block + alignment;
  new (p - sizeof(std::size_t)) std::size_t(size);
  live += size;
  peak = std::max(peak, live);
  return p;
}

void release(void* p, std::size_t alignment) {
  if (!p) return;
  char* given = static_cast<char*>(p);
  live -= *reinterpret_cast<std::size_t*>(given - sizeof(std::size_t));
  std::free(given - alignment);
}

constexpr std::size_t ordinary = alignof(std::max_align_t);
}  // namespace

void* operator new(std::size_t size) { return counted(size, ordinary); }
// Sanitizers have one of their own, whose blocks `release` does not know.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return counted(size, ordinary); }
void* operator new(std::size_t size, std::align_val_t a) { return counted(size, static_cast<std::size_t>(a)); }
void operator delete(void* p) noexcept { release(p, ordinary); }
void operator delete(void* p, std::size_t) noexcept { release(p, ordinary); }
void operator delete(void* p, std::align_val_t a) noexcept { release(p, static_cast<std::size_t>(a)); }
void operator delete(void* p, std::size_t, std::align_val_t a) noexcept { release(p, static_cast<std::size_t>(a)); }

namespace sheetbend::testing {
namespace {

struct Footprint : ::testing::TestWithParam<Solver> {};
INSTANTIATE_TEST_SUITE_P(, Footprint, all_solvers, solver_name);
INSTANTIATE_TEST_SUITE_P(Implicit, Footprint, ::testing::Values(implicit_bdf2), solver_name);
INSTANTIATE_TEST_SUITE_P(Cg, Footprint, ::testing::Values(newton_by_cg), solver_name);

// What `run` has allocated at its highest.
template <class Run>
double peak_of(Run&& run) {
  const std::size_t before = peak = live;
  run();
  return static_cast<double>(peak - before);
}

// A gradient over a few substeps with the least tape: rollout and reverse stand side by side. Lists of lists are not counted: less than a
// hundredth.
template <class T>
void expect_footprint(const Scene& scene, const Plan& plan, const std::vector<T>& inputs) {
  constexpr int steps = 6;
  const int kept = Schedule::least(steps, Tape<T>::window(plan));
  std::vector<T> x(scene.dofs()), inputs_bar(inputs.size());
  const double found = peak_of([&] {
    auto tape = record_rollout<T>(scene, plan, inputs.data(), 0.0, {steps}, x.data(), kept, nullptr);
    reverse_rollout<T>(scene, plan, inputs.data(), 0.0, tape, {steps}, x.data(), inputs_bar.data(), nullptr);
  });
  const auto told = static_cast<double>(rollout_bytes<T>(scene, plan) + reverse_bytes<T>(scene, plan) +
                                        (kept + Tape<T>::ends(plan)) * sizeof(T) * scene.dofs());
  EXPECT_NEAR(found, told, 0.01 * told);
}

TEST_P(Footprint, IsWhatIsAllocated) {
  const bool sweeps_or_blocks =
      GetParam().partition != Partition::newton && GetParam().partition != Partition::newton_cg;
  const Sample sample = random_scene(77, GetParam().shape(sweeps_or_blocks ? 60 : 12));
  SolverOptions options = GetParam().options(3);
  options.cg_tolerance = 1e-4;  // to be fast: bytes do not depend on it
  const Plan plan = make_plan(sample.scene, options);
  expect_footprint<double>(sample.scene, plan, sample.inputs);
  expect_footprint<Pack>(sample.scene, plan, {sample.inputs.begin(), sample.inputs.end()});
  expect_footprint<Dual<double, 1>>(sample.scene, plan, {sample.inputs.begin(), sample.inputs.end()});
}

TEST(FootprintOfSections, IsWhatIsAllocated) {
  const Sample sample = random_scene(77, {.ropes = 60});
  const Plan plan = make_plan(sample.scene, {.h = 4e-3, .partition = Partition::gauss_seidel, .iterations = 100});
  ASSERT_GT(sections_of<double>(plan.packs, 100).count(), 1);
  expect_footprint<double>(sample.scene, plan, sample.inputs);
  expect_footprint<Pack>(sample.scene, plan, {sample.inputs.begin(), sample.inputs.end()});
}

// A scene of one closed surface and nothing else.
TEST(FootprintOfAVolume, IsWhatIsAllocated) {
  const Sample sample = bipyramid(300);
  const Plan plan = make_plan(sample.scene, {.h = 4e-3, .partition = Partition::gauss_seidel, .iterations = 3});
  expect_footprint<double>(sample.scene, plan, sample.inputs);
  expect_footprint<Pack>(sample.scene, plan, {sample.inputs.begin(), sample.inputs.end()});
  expect_footprint<Dual<double, 1>>(sample.scene, plan, {sample.inputs.begin(), sample.inputs.end()});
}

// A rope above a plane, whose substeps may change their formula.
TEST(FootprintOfContacts, IsWhatIsAllocated) {
  ContactBuilder b;
  for (int i = 0; i < 300; ++i) b.particle({0.01 * i, 0.0, 0.1}, 0.001);
  for (int i = 0; i + 1 < 300; ++i) b.constraint("distance", {i, i + 1}, 0.01 / 50.0, {0.01});
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  b.contact(0.3, 0.0);
  const Sample sample = b.build(9.81);
  const Plan plan = make_plan(sample.scene, contact_options(1e-3, Integrator::bdf2));
  expect_footprint<double>(sample.scene, plan, sample.inputs);
  expect_footprint<Dual<double, 1>>(sample.scene, plan, {sample.inputs.begin(), sample.inputs.end()});
  SolverOptions sweeps = contact_options(1e-3);  // lanes keep no room for a second formula
  sweeps.partition = Partition::gauss_seidel, sweeps.iterations = 5;
  const Plan swept = make_plan(sample.scene, sweeps);
  expect_footprint<double>(sample.scene, swept, sample.inputs);
  expect_footprint<Pack>(sample.scene, swept, {sample.inputs.begin(), sample.inputs.end()});
  expect_footprint<Dual<double, 1>>(sample.scene, swept, {sample.inputs.begin(), sample.inputs.end()});
}

// Beside that plane one that goes one by one in plain numbers, because it is a distance field or because particles bounce off it.
TEST(FootprintOfMixedContacts, IsWhatIsAllocated) {
  for (const bool field : {false, true}) {
    ContactBuilder b;
    for (int i = 0; i < 300; ++i) b.particle({0.01 * i, 0.0, 0.1}, 0.001);
    for (int i = 0; i + 1 < 300; ++i) b.constraint("distance", {i, i + 1}, 0.01 / 50.0, {0.01});
    b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
    b.collider(field ? "distance_field" : "plane", {}, {0.0, 0.0, -0.1, 0.0, 0.0, 0.0});
    if (field) b.spec.colliders.back().grid = ball_on_grid(0.05, 0.01);
    b.contact(0.3, 0.0);
    if (!field) b.spec.contacts[1].bounces = true, b.restitution.push_back(0.5);
    const Sample sample = b.build(9.81);
    SolverOptions sweeps = contact_options(1e-3);
    sweeps.partition = Partition::gauss_seidel, sweeps.iterations = 5;
    const Plan plan = make_plan(sample.scene, sweeps);
    ASSERT_TRUE(plan.contact_groups[0].packed() && !plan.contact_groups[1].packed());
    expect_footprint<double>(sample.scene, plan, sample.inputs);
    expect_footprint<Pack>(sample.scene, plan, {sample.inputs.begin(), sample.inputs.end()});
    expect_footprint<Dual<double, 1>>(sample.scene, plan, {sample.inputs.begin(), sample.inputs.end()});
  }
}

TEST_P(Footprint, KeepsToTheBudget) {
  const Sample sample = random_scene(78, GetParam().shape());
  const Plan plan = make_plan(sample.scene, GetParam().options(2));
  const TapePlan whole = plan_tape<double>(sample.scene, plan, 500, 3, 1, no_budget);
  EXPECT_EQ(whole.states, 500);
  EXPECT_EQ(whole.recomputed, 0);
  for (const double share : {0.0, 0.1, 0.5, 1.0}) {
    const auto budget = whole.least + static_cast<std::size_t>(share * (whole.working() + whole.tape - whole.least));
    const TapePlan p = plan_tape<double>(sample.scene, plan, 500, 3, 1, budget);
    EXPECT_LE(p.working() + p.tape, budget);
    EXPECT_EQ(p.recomputed == 0, share == 1.0);
  }
  EXPECT_THROW(plan_tape<double>(sample.scene, plan, 500, 3, 1, whole.least - 1), BudgetTooSmall);
  const TapePlan batch = plan_tape<Pack>(sample.scene, plan, 500, 3, 20, no_budget);
  EXPECT_EQ(batch.lanes, 8);
  EXPECT_EQ(batch.at_once, 1);
  // Second derivatives: one scene per thread at a time, and the caller's arrays with their tangents.
  SolverOptions threaded = GetParam().options(2);
  threaded.threads = 2;
  const Plan two = make_plan(sample.scene, threaded);
  using D = Dual<double, 1>;
  const TapePlan one = plan_tape<D>(sample.scene, two, 500, 3, 1, no_budget);
  const TapePlan many = plan_tape<D>(sample.scene, two, 500, 3, 20, no_budget);
  EXPECT_EQ(many.at_once, 2);
  EXPECT_EQ(many.reverse, 2 * one.reverse);
  EXPECT_EQ(many.tape, 2 * one.tape);
  EXPECT_EQ(many.frames, (20 + 2) * 2 * sizeof(D) * 3 * sample.scene.dofs());
}

}  // namespace
}  // namespace sheetbend::testing
