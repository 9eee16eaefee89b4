#include "adjoint/library/json.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace sheetbend::library {
namespace {

constexpr int deepest = 64;

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  Json whole() {
    Json json = value(0);
    skip();
    if (at_ != text_.size()) fail("something follows the value");
    return json;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw NoJson(what, at_); }
  char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  void skip() { at_ = std::min(text_.find_first_not_of(" \t\n\r", at_), text_.size()); }
  bool take(char c) {
    skip();
    if (peek() != c) return false;
    ++at_;
    return true;
  }
  void expect(char c) {
    if (!take(c)) fail(std::string("'") + c + "' is missing");
  }
  bool word(std::string_view w) {
    if (text_.substr(at_, w.size()) != w) return false;
    at_ += w.size();
    return true;
  }

  Json value(int depth) {
    if (depth > deepest) fail("too many levels");
    skip();
    switch (peek()) {
      case '{': return {object(depth)};
      case '[': return {array(depth)};
      case '"': return {string()};
      default: break;
    }
    if (word("null")) return {nullptr};
    if (word("true")) return {true};
    if (word("false")) return {false};
    return number();
  }

  JsonObject object(int depth) {
    JsonObject members;
    expect('{');
    if (take('}')) return members;
    do {
      skip();
      if (peek() != '"') fail("a key is missing");
      std::string key = string();
      expect(':');
      members.emplace_back(std::move(key), value(depth + 1));
    } while (take(','));
    expect('}');
    std::vector<std::string_view> keys;
    for (const auto& [key, _] : members) keys.push_back(key);
    std::ranges::sort(keys);
    if (std::ranges::adjacent_find(keys) != keys.end()) fail("a key is there twice");
    return members;
  }

  JsonArray array(int depth) {
    JsonArray items;
    expect('[');
    if (take(']')) return items;
    do items.push_back(value(depth + 1));
    while (take(','));
    expect(']');
    return items;
  }

  Json number() {
    const std::size_t begin = at_;
    const auto digits = [&] {
      const std::size_t first = at_;
      while (peek() >= '0' && peek() <= '9') ++at_;
      if (at_ == first) fail("no value");
    };
    if (peek() == '-') ++at_;
    const std::size_t first = at_;
    digits();
    if (text_[first] == '0' && at_ > first + 1) fail("a number begins with 0");
    bool whole = true;
    if (peek() == '.') ++at_, digits(), whole = false;
    if (peek() == 'e' || peek() == 'E') {
      ++at_, whole = false;
      if (peek() == '+' || peek() == '-') ++at_;
      digits();
    }
    const char *from = text_.data() + begin, *to = text_.data() + at_;
    long long integer;
    if (whole && std::from_chars(from, to, integer).ec == std::errc()) return {integer};
    double real;
    if (std::from_chars(from, to, real).ec != std::errc()) fail("a number is out of range");
    return {real};
  }

  std::string string() {
    std::string out;
    ++at_;
    for (;; ++at_) {
      if (at_ >= text_.size()) fail("a text does not end");
      const char c = text_[at_];
      if (c == '"') break;
      if (static_cast<unsigned char>(c) < 0x20) fail("a control character stands in a text");
      if (c != '\\') {
        out += c;
        continue;
      }
      ++at_;
      constexpr std::string_view escapes = "\"\\/bfnrt", meant = "\"\\/\b\f\n\r\t";
      if (const auto k = escapes.find(peek()); peek() != '\0' && k != escapes.npos)
        out += meant[k];
      else if (peek() == 'u')
        encode(code_point(), out);
      else
        fail("an unknown escape");
    }
    ++at_;
    return out;
  }

  unsigned hex() {  // four digits after \u; stays at the last one
    unsigned code = 0;
    const char* from = text_.data() + at_ + 1;
    if (at_ + 4 >= text_.size() || std::from_chars(from, from + 4, code, 16).ptr != from + 4) fail("an unknown escape");
    at_ += 4;
    return code;
  }

  unsigned code_point() {
    const unsigned first = hex();
    if (first < 0xD800 || first > 0xDFFF) return first;
    if (first > 0xDBFF || text_.substr(at_ + 1, 2) != "\\u") fail("half of a surrogate pair");
    at_ += 2;
    const unsigned second = hex();
    if (second < 0xDC00 || second > 0xDFFF) fail("half of a surrogate pair");
    return 0x10000 + ((first - 0xD800) << 10) + (second - 0xDC00);
  }

  static void encode(unsigned c, std::string& out) {
    const auto tail = [&](int shift) { out += static_cast<char>(0x80 | ((c >> shift) & 0x3F)); };
    if (c < 0x80) {
      out += static_cast<char>(c);
    } else if (c < 0x800) {
      out += static_cast<char>(0xC0 | (c >> 6)), tail(0);
    } else if (c < 0x10000) {
      out += static_cast<char>(0xE0 | (c >> 12)), tail(6), tail(0);
    } else {
      out += static_cast<char>(0xF0 | (c >> 18)), tail(12), tail(6), tail(0);
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

const Json* Json::find(std::string_view key) const {
  const auto* members = as<JsonObject>();
  if (!members) return nullptr;
  const auto at = std::ranges::find(*members, key, [](const auto& m) -> std::string_view { return m.first; });
  return at == members->end() ? nullptr : &at->second;
}

Json parse_json(std::string_view text) { return Parser(text).whole(); }

long printable_length(std::string_view text) {
  long count = 0;
  for (std::size_t i = 0; i < text.size(); ++count) {
    const auto c = static_cast<unsigned char>(text[i++]);
    if (c < 0x20 || c == 0x7F) return -1;
    if (c < 0x80) continue;
    const int more = c >= 0xF0 ? 3 : c >= 0xE0 ? 2 : 1;
    if (c < 0xC2 || c > 0xF4) return -1;
    unsigned code = c & (0x3F >> more);
    for (int k = 0; k < more; ++k, ++i) {
      if (i >= text.size() || (text[i] & 0xC0) != 0x80) return -1;
      code = code << 6 | (text[i] & 0x3F);
    }
    constexpr unsigned least[]{0, 0xA0, 0x800, 0x10000};  // longer forms than needed, and the controls before 0xA0
    if (code < least[more] || (code >= 0xD800 && code <= 0xDFFF) || code > 0x10FFFF) return -1;
  }
  return count;
}

}  // namespace sheetbend::library
