// JSON as the header of a scene's file has it (RFC 8259), read strictly: nothing that a writer would not write.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace sheetbend::library {

struct Json;
using JsonArray = std::vector<Json>;
using JsonObject = std::vector<std::pair<std::string, Json>>;

// A number without fraction and exponent that fits in 64 bits is a long long, any other one a double.
struct Json {
  std::variant<std::nullptr_t, bool, long long, double, std::string, JsonArray, JsonObject> value;

  template <class T>
  const T* as() const {
    return std::get_if<T>(&value);
  }
  // A member of an object; null where there is none.
  const Json* find(std::string_view key) const;
};

// What is wrong, and at which byte.
struct NoJson : std::runtime_error {
  NoJson(const std::string& what, std::size_t at)
      : std::runtime_error(what + " at byte " + std::to_string(at)) {}
};

// Throws NoJson; also for keys that are there twice, numbers beyond double's range, and more than 64 levels.
Json parse_json(std::string_view text);

// The code points of a text in UTF-8, or -1 where it is none or holds control characters.
long printable_length(std::string_view text);

}  // namespace sheetbend::library
