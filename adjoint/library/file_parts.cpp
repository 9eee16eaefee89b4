#include "adjoint/library/file_parts.h"

#include <sheetbend/error.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <system_error>

namespace sheetbend::library {
namespace {

static_assert(std::endian::native == std::endian::little, "the file's numbers are read as they lie");

constexpr std::string_view magic = "SBSCENE\n";
constexpr std::uint32_t version = 1;
constexpr std::size_t prefix = 24, longest_header = 16u << 20;
constexpr long longest_name = 200;
constexpr int deepest = 64;
constexpr const char* damaged = "the file is damaged or was not written by save_scene: write it again";

// CRC-32 as in zlib (polynomial 0xEDB88320, reflected).
std::uint32_t crc32(const char* data, std::size_t size) {
  static const auto table = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      t[i] = i;
      for (int bit = 0; bit < 8; ++bit) t[i] = t[i] & 1 ? 0xEDB88320u ^ (t[i] >> 1) : t[i] >> 1;
    }
    return t;
  }();
  std::uint32_t c = 0xFFFFFFFFu;
  for (std::size_t i = 0; i < size; ++i) c = table[(c ^ static_cast<unsigned char>(data[i])) & 0xFF] ^ (c >> 8);
  return ~c;
}

// A header without depth limit could be a million lists in each other. Of a key that is there twice the last one
// counts, as in Python.
Json parsed(const char* begin, const char* end) {
  return Json::parse(begin, end, [](int depth, Json::parse_event_t, const Json&) {
    if (depth > deepest) throw std::length_error("too many levels");
    return true;
  });
}

// The code points of a text in UTF-8, or -1 where it holds control characters (U+0000 to U+001F, U+007F to U+009F).
long printable_length(const std::string& text) {
  long count = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c < 0x20 || c == 0x7F || (c == 0xC2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xA0))
      return -1;
    count += (c & 0xC0) != 0x80;  // not the bytes that continue a code point
  }
  return count;
}

template <class T>
T read_as(const char* from) {
  T value;
  std::memcpy(&value, from, sizeof(T));
  return value;
}

std::uintmax_t free_memory() {
  const long pages = sysconf(_SC_AVPHYS_PAGES), size = sysconf(_SC_PAGESIZE);
  return pages > 0 && size > 0 ? static_cast<std::uintmax_t>(pages) * static_cast<std::uintmax_t>(size)
                               : std::numeric_limits<std::uintmax_t>::max();
}

}  // namespace

FileParts::FileParts(const std::filesystem::path& path) : path_(path.string()) {
  const char* own = "give a file that save_scene wrote";
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  if (error || !file) fail("file", "cannot be read", own);
  char head[prefix];
  if (size < prefix || !file.read(head, prefix) || std::string_view(head, magic.size()) != magic)
    fail("file", "is no scene file", own);
  if (const auto found = read_as<std::uint32_t>(head + 8); found != version)
    fail("version", "is " + std::to_string(found),
         "write it again with this version, which reads " + std::to_string(version));
  if (size > free_memory() / 2) fail("file", "does not fit in the free memory", "use a larger machine");
  const auto length = read_as<std::uint64_t>(head + 16);
  if (length > longest_header || length > size - prefix) fail("header", "is longer than the file or than any header");
  body_.resize(size - prefix);
  file.read(body_.data(), static_cast<std::streamsize>(body_.size()));
  if (static_cast<std::size_t>(file.gcount()) != body_.size() ||
      crc32(body_.data(), body_.size()) != read_as<std::uint32_t>(head + 12))
    fail("file", "is damaged: its check sum differs");
  try {
    header_ = parsed(body_.data(), body_.data() + length);
  } catch (const Json::parse_error& e) {  // its words may repeat bytes that are no text
    fail("header", "is no JSON at byte " + std::to_string(e.byte));
  } catch (const Json::out_of_range&) {
    fail("header", "holds a number out of range");
  } catch (const std::length_error& e) {
    fail("header", std::string("has ") + e.what());
  }
  if (!header_.is_object()) fail("header", "is no object");
  first_ = length;
  left_ = body_.size() - length;
}

void FileParts::fail(const std::string& field, const std::string& problem, const std::string& fix) const {
  throw v0::InputError(path_ + ": " + field, problem, fix.empty() ? damaged : fix);
}

const Json& FileParts::member(const Json& parent, const std::string& key, const std::string& where) const {
  const auto found = parent.find(key);
  if (found == parent.end()) fail(where + key, "is missing");
  return *found;
}

const Json& FileParts::object(const Json& parent, const std::string& key, const std::string& where) const {
  const Json& found = member(parent, key, where);
  if (!found.is_object()) fail(where + key, "is no object");
  return found;
}

const Json& FileParts::list(const Json& parent, const std::string& key, const std::string& where) const {
  const Json& found = member(parent, key, where);
  if (!found.is_array()) fail(where + key, "is no list");
  return found;
}

const std::string& FileParts::text(const Json& parent, const std::string& key, const std::string& where) const {
  const Json& found = member(parent, key, where);
  if (!found.is_string()) fail(where + key, "is no text");
  return found.get_ref<const std::string&>();
}

bool FileParts::flag(const Json& parent, const std::string& key, const std::string& where) const {
  const Json& found = member(parent, key, where);
  if (!found.is_boolean()) fail(where + key, "is neither true nor false");
  return found.get<bool>();
}

long long FileParts::whole(const Json& parent, const std::string& key, const std::string& where) const {
  const Json& found = member(parent, key, where);
  if (!found.is_number_integer()) fail(where + key, "is no whole number");
  return found.get<long long>();
}

double FileParts::number(const Json& parent, const std::string& key, const std::string& where) const {
  const Json& found = member(parent, key, where);
  const double value = found.is_number() ? found.get<double>() : std::nan("");
  if (!(std::abs(value) < 1e300)) fail(where + key, "must be a finite number");
  return value;
}

bool FileParts::is_name(const Json& value) const {
  const long length = value.is_string() ? printable_length(value.get_ref<const std::string&>()) : -1;
  return length >= 0 && length <= longest_name;
}

std::string FileParts::name(const Json& parent, const std::string& key, const std::string& where) const {
  if (!is_name(member(parent, key, where))) fail(where + key, "is no name");
  return text(parent, key, where);
}

const char* FileParts::place(const std::string& name, const char* type, std::size_t width, int columns,
                             std::optional<long long> rows, std::size_t& count) {
  const Json& about = object(object(header_, "arrays"), name, "arrays.");
  const Json& shape = list(about, "shape", name + ".");
  if (text(about, "type", name + ".") != type || shape.size() != (columns == 0 ? 1 : 2))
    fail(name,
         std::string("must be of type ") + type + (columns == 0 ? " with one dimension" : " with two dimensions"));
  const auto length = [&](std::size_t i) {
    const auto n = shape[i].is_number_integer() ? shape[i].get<long long>() : -1;
    if (n < 0) fail(name + ".shape", "must be whole numbers from 0 on");
    return n;
  };
  const long long own_rows = length(0), own_columns = columns == 0 ? 1 : length(1);
  if ((rows && own_rows != *rows) || (columns > 0 && own_columns != columns)) fail(name, "has another shape");
  const long long offset = whole(about, "offset", name + ".");
  const std::size_t data = body_.size() - first_;
  const std::size_t most = own_columns > 0 ? left_ / width / static_cast<std::size_t>(own_columns) : left_;
  if (static_cast<std::size_t>(own_rows) > most) fail(name, "lies outside the file, or on another array");
  count = static_cast<std::size_t>(own_rows) * static_cast<std::size_t>(own_columns);
  if (offset < 0 || static_cast<std::size_t>(offset) > data || count * width > data - static_cast<std::size_t>(offset))
    fail(name, "lies outside the file");
  left_ -= count * width;
  return body_.data() + first_ + offset;
}

std::vector<int> FileParts::whole_numbers(const std::string& name, int columns, std::optional<long long> rows) {
  std::size_t count;
  const char* from = place(name, "i4", 4, columns, rows, count);
  std::vector<int> values(count);
  if (count > 0) std::memcpy(values.data(), from, 4 * count);
  return values;
}

std::vector<double> FileParts::numbers(const std::string& name, int columns, std::optional<long long> rows) {
  std::size_t count;
  const char* from = place(name, "f8", 8, columns, rows, count);
  std::vector<double> values(count);
  if (count > 0) std::memcpy(values.data(), from, 8 * count);
  for (const double value : values)
    if (!std::isfinite(value)) fail(name, "holds numbers that are not finite");
  return values;
}

}  // namespace sheetbend::library
