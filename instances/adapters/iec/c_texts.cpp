#include "instances/adapters/iec/c_texts.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <utility>

namespace plchost::iec {

namespace {

bool is_hexadecimal(char c) noexcept {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}

class EscapeReader {
 public:
  EscapeReader(std::string_view code, std::string_view before) : code_(code), before_(before) {}

  std::string run() {
    while (at_ < code_.size()) {
      const std::string_view rest = code_.substr(at_);
      if (rest.starts_with("//")) {
        take(std::min(rest.find('\n'), rest.size()));
      } else if (rest.starts_with("/*")) {
        take(std::min(rest.find("*/", 2), rest.size() - 2) + 2);
      } else if (rest.front() == '"' || rest.front() == '\'') {
        take_text();
      } else {
        take(1);
      }
    }
    return std::move(made_);
  }

 private:
  void take(std::size_t bytes) {
    made_ += code_.substr(at_, bytes);
    at_ = std::min(at_ + bytes, code_.size());
  }

  // No text goes beyond its line.
  void take_text() {
    const char quote = code_[at_];
    const std::string_view done = code_.substr(0, at_);
    const bool changes = quote == '"' && is_wanted(done);
    const std::size_t digits = done.ends_with('u') ? 4 : 2;
    take(1);
    while (at_ < code_.size() && code_[at_] != '\n') {
      if (changes && code_.substr(at_).starts_with("\\x")) {
        take_escape(digits);
      } else if (code_[at_] == '\\') {
        take(2);
      } else {
        const bool is_end = code_[at_] == quote;
        take(1);
        if (is_end) return;
      }
    }
  }
  void take_escape(std::size_t digits) {
    take(2);
    for (; digits > 0 && at_ < code_.size() && is_hexadecimal(code_[at_]); --digits) take(1);
    if (at_ < code_.size() && is_hexadecimal(code_[at_])) made_ += "\"\"";
  }

  // __STRING_LITERAL(7,"...
  [[nodiscard]] bool is_wanted(std::string_view done) const {
    if (before_.empty()) return true;
    if (!done.ends_with(',')) return false;
    done.remove_suffix(1);
    while (!done.empty() && done.back() >= '0' && done.back() <= '9') done.remove_suffix(1);
    return done.ends_with(before_);
  }

  std::string_view code_;
  std::string_view before_;
  std::size_t at_ = 0;
  std::string made_;
};

}  // namespace

bool is_of_name(char c) noexcept {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

std::string with_ended_escapes(std::string_view code, std::string_view before) {
  return EscapeReader(code, before).run();
}

std::size_t find_outside(std::string_view code, std::string_view wanted, std::size_t from) {
  int depth = 0;
  char quote = '\0';
  for (std::size_t i = from; i < code.size(); ++i) {
    const char c = code[i];
    if (quote != '\0') {
      if (c == '\\') ++i;
      if (c == quote) quote = '\0';
      continue;
    }
    if (depth == 0 && code.substr(i).starts_with(wanted)) return i;
    if (c == '"' || c == '\'') quote = c;
    if (c == '(' || c == '[') ++depth;
    if ((c == ')' || c == ']') && --depth < 0) break;
  }
  return std::string_view::npos;
}

std::size_t find_close(std::string_view code, std::size_t begin) {
  return find_outside(code, code[begin] == '[' ? "]" : ")", begin + 1);
}

}  // namespace plchost::iec
