// Residuals as blocks of a problem of Ceres: gradients of two recordings alone and together, a constant block, a point
// without an answer.
#include <ceres/ceres.h>
#include <sheetbend/residuals.h>

#include "shown.h"

int main(int, char** arguments) {
  using namespace sheetbend;
  return shown([&] {
    const Scene scene = Scene::load(arguments[1]);
    const auto residuals = [&](double x) {
      const Observations observed{
          .times = {0.02, 0.05}, .markers = {Marker::on(4)}, .positions = {x, 0.0, 0.1, x, 0.1, 0.1}};
      return new Residuals(scene, observed, {.h = 1e-3}, {"rope_EI", "rope_density"});
    };
    double EI = 2e-3, density = 0.04;
    const auto gradient = [&](std::initializer_list<double> recordings) {
      ceres::Problem problem;
      for (const double x : recordings) problem.AddResidualBlock(residuals(x), nullptr, &EI, &density);
      std::vector<double> found;
      problem.Evaluate({}, nullptr, nullptr, &found, nullptr);
      return found;
    };
    print("one", gradient({0.1}));
    print("two", gradient({0.2}));
    print("both", gradient({0.1, 0.2}));

    const std::unique_ptr<Residuals> block(residuals(0.1));
    double r[6], whole[2][6], part[6];
    const double* at[]{&EI, &density};
    double *all[]{whole[0], whole[1]}, *second[]{nullptr, part};
    const bool found = block->Evaluate(at, r, all) && block->Evaluate(at, r, second) && block->Evaluate(at, r, nullptr);
    std::printf("untouched %d\n", found && std::equal(part, part + 6, whole[1]));
    EI = -1.0;
    std::printf("refused %d\n", !block->Evaluate(at, r, nullptr) &&
                                    block->function().failure().find("compliance") != std::string::npos);
  });
}
