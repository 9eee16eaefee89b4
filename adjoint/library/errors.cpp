#include <sheetbend/error.h>

#include "adjoint/library/model.h"

namespace sheetbend::v0 {

InputError::InputError(std::string field, std::string problem, std::string fix)
    : Error(field + ": " + problem + ". Fix: " + fix + "."),
      field_(std::move(field)),
      problem_(std::move(problem)),
      fix_(std::move(fix)) {}

InputError refusal(const std::string& message, const std::string& field) {
  const std::size_t colon = message.find(": "), fix = message.find(". Fix: ");
  if (colon == message.npos || fix == message.npos || fix < colon)
    return {field.empty() ? "input" : field, message, "see above"};
  const std::string where = message.substr(0, colon);
  return {field.empty() ? where : field + ": " + where, message.substr(colon + 2, fix - colon - 2),
          message.substr(fix + 7)};
}

void check_size(const char* field, std::size_t got, std::size_t wanted) {
  if (got != wanted)
    throw InputError(field, "has " + std::to_string(got) + " numbers", "give " + std::to_string(wanted));
}

void check_finite(const char* field, std::span<const double> numbers) {
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (!std::isfinite(numbers[i]))
      throw InputError(field, "is not finite at " + std::to_string(i), "give finite numbers");
}

}  // namespace sheetbend::v0
