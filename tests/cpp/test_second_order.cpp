// Forward over reverse: the reverse on dual numbers gives Hessian-vector products.
#include "adjoint/rollout/rollout_impl.h"
#include "core/scalar/complex.h"
#include "tests/cpp/support/programs.h"

namespace sheetbend::testing {
namespace {

using Dual1 = Dual<double, 1>;

struct ForwardOverReverse : ::testing::TestWithParam<Solver> {};
INSTANTIATE_TEST_SUITE_P(, ForwardOverReverse, all_solvers, solver_name);
INSTANTIATE_TEST_SUITE_P(Implicit, ForwardOverReverse, ::testing::Values(implicit_bdf2), solver_name);
INSTANTIATE_TEST_SUITE_P(Cg, ForwardOverReverse, ::testing::Values(newton_by_cg), solver_name);

TEST_P(ForwardOverReverse, MatchesComplexStepOfTheGradient) {
  const Sample sample = random_scene(60, GetParam().shape());
  const Layout& layout = sample.scene.layout;
  const Program program{sample.scene, make_plan(sample.scene, GetParam().options(2)), 5, 0.004};
  Random random(60);
  // One direction per quantity: each column of blocks of the Hessian is seen by itself.
  for (int q = 0; q < quantity_count; ++q) {
    SCOPED_TRACE(quantity_names[q]);
    if (layout.size[q] == 0 && (is_of_volumes(q) || is_of_contacts(q))) continue;
    std::vector<double> direction(layout.total());
    for (std::size_t i = layout.offset[q]; i < layout.offset[q + 1]; ++i)
      direction[i] = random(-1.0, 1.0) * std::abs(sample.inputs[i]);
    std::vector<Dual1> probe(layout.total());
    for (std::size_t i = 0; i < probe.size(); ++i) probe[i].v = sample.inputs[i], probe[i].d[0] = direction[i];
    std::vector<double> product;
    for (const Dual1& d : gradient(program, probe)) product.push_back(d.d[0]);
    const auto oracle = complex_step_along([&](const std::vector<Complex>& z) { return gradient(program, z); },
                                           sample.inputs, direction);
    expect_gradients_agree(layout, product, oracle, 1e-8);
  }
}

TEST_P(ForwardOverReverse, HessianIsSymmetric) {
  const Sample sample = random_scene(61, GetParam().shape());
  const Program program{sample.scene, make_plan(sample.scene, GetParam().options(2)), 8};
  Random random(61);
  const auto product = [&](const std::vector<double>& v) {
    std::vector<Dual1> probe(v.size());
    for (std::size_t i = 0; i < v.size(); ++i) probe[i].v = sample.inputs[i], probe[i].d[0] = v[i];
    std::vector<double> Hv;
    for (const Dual1& d : gradient(program, probe)) Hv.push_back(d.d[0]);
    return Hv;
  };
  std::vector<double> a(sample.inputs.size()), b(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    a[i] = random(-1.0, 1.0) * std::abs(sample.inputs[i]);
    b[i] = random(-1.0, 1.0) * std::abs(sample.inputs[i]);
  }
  const auto Ha = product(a);
  double size = 0.0;
  for (std::size_t i = 0; i < b.size(); ++i) size += std::abs(b[i] * Ha[i]);
  EXPECT_LE(std::abs(dot(b, Ha) - dot(a, product(b))), 1e-10 * size);
}

}  // namespace
}  // namespace sheetbend::testing
