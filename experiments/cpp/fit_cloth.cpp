// Fits quantities of a saved scene to a recording with Ceres: fit_cloth SCENE CSV QUANTITY...
#include <ceres/ceres.h>
#include <sheetbend/residuals.h>
#include <sheetbend/sheetbend.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

// A table "time,12_x,12_y,12_z,40_x,...": markers by the particle that they sit on, empty cells where one was not seen.
sheetbend::Observations read_table(const char* path) {
  sheetbend::Observations observed;
  std::ifstream file(path);
  std::string line, cell;
  if (!std::getline(file, line) || !line.starts_with("time,"))
    throw sheetbend::InputError(path, "has no header", "begin the table with time,12_x,12_y,12_z");
  std::istringstream header(line);
  for (int column = 0; std::getline(header, cell, ','); ++column)
    if (column % 3 == 1) observed.markers.push_back(sheetbend::Marker::on(std::stoi(cell)));
  while (std::getline(file, line)) {
    std::istringstream row(line + ',');  // which ends the last cell, empty or not
    for (int column = 0; std::getline(row, cell, ','); ++column)
      (column == 0 ? observed.times : observed.positions).push_back(cell.empty() ? NAN : std::stod(cell));
  }
  return observed;
}

int main(int count, char** arguments) {
  if (count < 4) {
    std::fprintf(stderr, "usage: %s SCENE CSV QUANTITY...\n", arguments[0]);
    return 2;
  }
  try {
    const auto scene = sheetbend::Scene::load(arguments[1]);
    std::vector<sheetbend::Parameter> parameters;
    for (int i = 3; i < count; ++i) parameters.emplace_back(arguments[i], sheetbend::Scale::logarithmic);
    const sheetbend::Solver solver{.h = 1.0 / 240.0, .method = sheetbend::Method::newton};
    auto* residuals = new sheetbend::Residuals(scene, read_table(arguments[2]), solver, parameters);

    std::vector<double> u = residuals->function().start();
    std::vector<double*> blocks;
    for (double& parameter : u) blocks.push_back(&parameter);
    ceres::Problem problem;  // owns the residuals
    problem.AddResidualBlock(residuals, nullptr, blocks);
    ceres::Solver::Options options;
    options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-16;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);

    std::printf("cost %.17g after %zu steps\n", summary.final_cost, summary.iterations.size());
    const std::vector<double> values = residuals->function().values(u);
    for (const auto& parameter : parameters)
      std::printf("%s %.17g\n", parameter.name.c_str(), values[scene.quantity(parameter.name)]);
    return summary.IsSolutionUsable() ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
