// The parts of a scene's file: its header, and arrays of numbers that lie behind it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace sheetbend::library {

using Json = nlohmann::json;

class FileParts {
 public:
  // Reads the whole file. Throws InputError, as everything here does.
  explicit FileParts(const std::filesystem::path& path);

  const Json& header() const { return header_; }

  [[noreturn]] void fail(const std::string& field, const std::string& problem, const std::string& fix = {}) const;

  // A member of an object, of the type that the name says. `where` stands before the key in errors.
  const Json& object(const Json& parent, const std::string& key, const std::string& where = "") const;
  const Json& list(const Json& parent, const std::string& key, const std::string& where = "") const;
  const std::string& text(const Json& parent, const std::string& key, const std::string& where = "") const;
  bool flag(const Json& parent, const std::string& key, const std::string& where = "") const;
  long long whole(const Json& parent, const std::string& key, const std::string& where = "") const;
  double number(const Json& parent, const std::string& key, const std::string& where = "") const;  // finite
  std::string name(const Json& parent, const std::string& key, const std::string& where = "") const;
  bool is_name(const Json& value) const;

  bool has(const std::string& array) const { return header_.contains("arrays") && header_["arrays"].contains(array); }
  // Arrays (rows, columns) of the file, row by row, or (rows) where columns = 0. A file cannot hold the same bytes
  // twice, so arrays take no more memory than it has.
  std::vector<int> whole_numbers(const std::string& name, int columns = 0, std::optional<long long> rows = {});
  std::vector<double> numbers(const std::string& name, int columns = 0, std::optional<long long> rows = {});

 private:
  const Json& member(const Json& parent, const std::string& key, const std::string& where) const;

  // Where the bytes of an array are, and how many numbers it has.
  const char* place(const std::string& name, const char* type, std::size_t width, int columns,
                    std::optional<long long> rows, std::size_t& count);

  std::string path_;
  std::vector<char> body_;
  Json header_;
  std::size_t first_ = 0;  // byte of the data
  std::size_t left_ = 0;   // bytes that arrays may still take
};

}  // namespace sheetbend::library
