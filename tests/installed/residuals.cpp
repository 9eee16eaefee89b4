// Residuals, Jacobian and simulated markers at the scene's own values and 5 % above: residuals SCENE OBSERVED
// [loss=...] [rest] [hanging] [linear] [key=value...] QUANTITY... OBSERVED: numbers of frames and markers, per marker
// two particles and a fraction, times, positions.
#include <cmath>
#include <fstream>

#include "shown.h"

int main(int count, char** arguments) {
  using namespace sheetbend;
  return shown([&] {
    const Scene scene = Scene::load(arguments[1]);
    std::ifstream file(arguments[2]);
    const auto number = [&] {
      std::string word;
      file >> word;
      return std::strtod(word.c_str(), nullptr);
    };
    Observations observed;
    const auto frames = static_cast<std::size_t>(number()), markers = static_cast<std::size_t>(number());
    for (std::size_t m = 0; m < markers; ++m) {
      const int first = static_cast<int>(number()), second = static_cast<int>(number());
      const double fraction = number();
      observed.markers.push_back(fraction == 0.0 ? Marker::on(first) : Marker::between(first, second, fraction));
    }
    for (std::size_t f = 0; f < frames; ++f) observed.times.push_back(number());
    for (std::size_t i = 0; i < 3 * frames * markers; ++i) observed.positions.push_back(number());
    observed.sigma = 2e-3;
    std::vector<Parameter> parameters;
    Scale scale = Scale::logarithmic;
    for (int i = 3; i < count; ++i) {
      const std::string argument = arguments[i];
      if (argument == "loss=huber")
        observed.loss = Loss::huber, observed.loss_scale = 1.5;
      else if (argument == "loss=soft_l1")
        observed.loss = Loss::soft_l1, observed.loss_scale = 1.5;
      else if (argument == "rest")
        observed.at_rest = true;
      else if (argument == "hanging")
        observed.starts_at_rest = true;
      else if (argument == "linear")
        scale = Scale::linear;
      else if (argument.find('=') == argument.npos)
        parameters.emplace_back(argument, scale);
    }
    const ResidualFunction function(scene, observed, solver_of(count, arguments), parameters);
    std::vector<double> u = function.start();
    for (const double more : {0.0, 0.05}) {
      for (double& x : u) x += scale == Scale::linear ? more * x : more;
      std::vector<double> residual(static_cast<std::size_t>(function.rows())), jacobian(residual.size() * u.size());
      const bool ok = function.evaluate(u, residual.data(), jacobian.data());
      std::printf("ok %d %s\n", ok, ok ? "" : function.failure().c_str());
      const std::string at = more == 0.0 ? "" : "_above";
      print("u" + at, u);
      print("values" + at, function.values(u));
      print("residual" + at, residual);
      print("jacobian" + at, jacobian);
      print("simulated" + at, function.simulate(u));
    }
    std::vector<double> nowhere(u.size(), scale == Scale::linear ? -1.0 : 800.0),
        residual(static_cast<std::size_t>(function.rows()));
    const bool ok = function.evaluate(nowhere, residual.data());
    std::printf("nowhere %d %s\n", ok, function.failure().c_str());
  });
}
