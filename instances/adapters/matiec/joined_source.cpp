#include "instances/adapters/matiec/joined_source.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "instances/adapters/iec/pragmas.hpp"
#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/matiec/temporaries.hpp"

namespace plchost::matiec {

namespace {

using iec::Token;

void blank(std::string& text, std::size_t offset, std::size_t bytes) {
  for (char& c : std::span(text).subspan(offset, bytes)) {
    if (c != '\n' && c != '\r') c = ' ';
  }
}

bool is_unknown_to_iec2c(const Token& interval) {
  if (interval.kind != Token::Kind::literal) return false;
  const std::string text = iec::folded(interval.text);
  return text.starts_with('L') || text.contains("US") || text.contains("NS");
}

// Of the tasks in a configuration: an INTERVAL elsewhere may be the name of a variable.
class IntervalFinder {
 public:
  /// Of each token, in the order of the source.
  [[nodiscard]] bool is_interval(const Token& token) {
    if (token.is("CONFIGURATION")) in_configuration_ = true;
    if (token.is("END_CONFIGURATION")) in_configuration_ = false;
    if (token.is("TASK")) in_task_ = in_configuration_;
    if (token.is(")") || token.is(";")) in_task_ = false;
    const bool result = in_task_ && behind_ == 2;
    if (token.is("INTERVAL")) {
      behind_ = 1;
    } else {
      behind_ = behind_ == 1 && token.is(":=") ? 2 : 0;
    }
    return result;
  }

 private:
  bool in_configuration_ = false;
  bool in_task_ = false;
  int behind_ = 0;  // 1: INTERVAL, 2: INTERVAL :=
};

// iec2c wants located variables of a program in sections of their own.
class SectionSplitter {
 public:
  /// Each token, in the order of the source.
  void look(const Token& token) {
    if (token.is("PROGRAM")) in_program_ = true;
    if (token.is("END_PROGRAM") || token.is("CONFIGURATION")) in_program_ = false;
    if (token.is("VAR") && in_program_) {
      begin_section();
    } else if (in_section_) {
      look_in_section(token);
    }
  }
  using Insertions = std::vector<std::pair<std::size_t, std::string>>;
  /// By their offset in the source.
  [[nodiscard]] const Insertions& insertions() const noexcept { return insertions_; }

 private:
  void begin_section() {
    in_section_ = true;
    qualifiers_.clear();
    words_ = 0;
    is_located_ = false;
    end_.reset();
  }
  void look_in_section(const Token& token) {
    const bool qualifies = token.is("RETAIN") || token.is("NON_RETAIN") || token.is("CONSTANT");
    if (token.is("END_VAR")) {
      in_section_ = false;
    } else if (words_ == 0 && !end_ && qualifies) {
      qualifiers_ += " " + token.text;
    } else if (token.is(";")) {
      end_declaration(token.offset + 1);
    } else {
      is_located_ = is_located_ || (words_ == 1 && token.is("AT"));
      ++words_;
    }
  }
  void end_declaration(std::size_t end) {
    if (end_ && is_located_ != was_located_) insertions_.emplace_back(*end_, " END_VAR VAR" + qualifiers_);
    was_located_ = std::exchange(is_located_, false);
    words_ = 0;
    end_ = end;
  }

  Insertions insertions_;
  bool in_program_ = false;
  bool in_section_ = false;
  std::string qualifiers_;
  int words_ = 0;  // of this declaration
  bool is_located_ = false;
  bool was_located_ = false;        // the one before
  std::optional<std::size_t> end_;  // of the one before
};

// iec2c counts one column too many in the rest of the line in which a body begins, as it reads the first
// character twice. Not if the body begins with a word that it knows at that point.
class BodyFinder {
 public:
  /// Each token, in the order of the source.
  void look(const Token& token) {
    if (awaits_ && token.kind != Token::Kind::pragma) {
      awaits_ = false;
      if (!is_one_of(token, kOthers)) begins_.push_back(token.offset);
    }
    if (token.is("PROGRAM") || token.is("FUNCTION") || token.is("FUNCTION_BLOCK")) in_pou_ = true;
    if (token.is("END_PROGRAM") || token.is("END_FUNCTION") || token.is("END_FUNCTION_BLOCK") ||
        token.is("CONFIGURATION"))
      in_pou_ = false;
    if (token.is("END_VAR")) awaits_ = in_pou_;
  }
  /// Offsets in the source. In order.
  [[nodiscard]] const std::vector<std::size_t>& begins() const noexcept { return begins_; }

 private:
  // Another section, the end, or what it knows.
  static constexpr std::array<std::string_view, 19> kOthers{"VAR",
                                                            "VAR_INPUT",
                                                            "VAR_OUTPUT",
                                                            "VAR_IN_OUT",
                                                            "VAR_EXTERNAL",
                                                            "VAR_TEMP",
                                                            "VAR_ACCESS",
                                                            "END_PROGRAM",
                                                            "END_FUNCTION",
                                                            "END_FUNCTION_BLOCK",
                                                            "RETURN",
                                                            "IF",
                                                            "CASE",
                                                            "FOR",
                                                            "WHILE",
                                                            "EXIT",
                                                            "REPEAT",
                                                            "INITIAL_STEP",
                                                            ":="};
  [[nodiscard]] static bool is_one_of(const Token& token, std::span<const std::string_view> words) {
    return std::ranges::any_of(words, [&](std::string_view word) { return token.is(word); });
  }

  bool in_pou_ = false;
  bool awaits_ = false;  // a body, behind a section
  std::vector<std::size_t> begins_;
};

// Of the actions of charts: iec2c counts the lines twice that are empty before a body. A comment keeps it
// from that.
class ActionFinder {
 public:
  /// Each token, in the order of the source: whether it is the colon before a body.
  [[nodiscard]] bool ends_head(const Token& token) {
    const bool result = behind_ == 2 && token.is(":");
    if (token.is("ACTION")) {
      behind_ = 1;
    } else {
      behind_ = behind_ == 1 && token.kind == Token::Kind::name ? 2 : 0;
    }
    return result;
  }

 private:
  int behind_ = 0;  // 1: ACTION, 2: ACTION NAME
};

struct TextForIec2c {
  std::string text;
  std::vector<iec::Stretch> inserted;
  std::vector<std::size_t> bodies;  // by their offset in the source
};

/// Inserts the words, and drops the mark of UTF-8.
TextForIec2c with_insertions(std::string_view text, const SectionSplitter::Insertions& insertions) {
  TextForIec2c result;
  std::size_t done = iec::byte_order_mark(text);
  for (const auto& [offset, words] : insertions) {
    result.text += text.substr(done, offset - done);
    result.inserted.push_back({result.text.size(), words.size()});
    result.text += words;
    done = offset;
  }
  result.text += text.substr(done);
  return result;
}

/// Writes signs of a text by their code where iec2c would take them for others: "(*" begins a comment in a
/// text, too, and $L is a line feed in C.
void name_signs(const Token& token, std::string& text, SectionSplitter::Insertions& insertions) {
  const auto write = [&](std::size_t at, std::string_view first, std::string_view more) {
    text.replace(token.offset + at, first.size(), first);
    insertions.emplace_back(token.offset + at + first.size(), more);
  };
  for (std::size_t i = 0; i + 1 < token.text.size(); ++i) {
    const std::string_view rest = std::string_view(token.text).substr(i);
    if (rest.starts_with("(*")) write(i, "$", "28");
    if (rest.starts_with("$L") || rest.starts_with("$l")) write(i, "$0", "A");
    if (rest.starts_with('$')) ++i;
  }
}

TextForIec2c for_iec2c(const iec::Source& source) {
  constexpr std::string_view kAnyInterval = "T#1ms";
  constexpr std::string_view kVar = "VAR";  // of VAR_TEMP
  std::string text = source.text;
  const iec::Tokens tokens = iec::tokens_of(text, source.file);
  for (const iec::Stretch& comment : tokens.new_comments) blank(text, comment.offset, comment.bytes);
  IntervalFinder intervals;
  SectionSplitter sections;
  BodyFinder bodies;
  ActionFinder actions;
  TemporarySections temporaries;
  SectionSplitter::Insertions insertions;
  for (const Token& token : tokens.all) {
    if (iec::is_of_other_tools(token)) {  // any other pragma is C for iec2c, or one of its own
      blank(text, token.offset, token.text.size());
      continue;
    }
    const bool is_interval = intervals.is_interval(token);
    sections.look(token);
    bodies.look(token);
    if (actions.ends_head(token)) insertions.emplace_back(token.offset + token.text.size(), " (**)");
    if (temporaries.begins_one(token))
      blank(text, token.offset + kVar.size(), token.text.size() - kVar.size());
    if (token.kind == Token::Kind::text) {
      name_signs(token, text, insertions);
    } else if (token.kind == Token::Kind::place) {
      text.replace(token.offset, token.text.size(), iec::folded(token.text));
    } else if (is_interval && is_unknown_to_iec2c(token) && token.text.size() >= kAnyInterval.size()) {
      blank(text, token.offset, token.text.size());
      text.replace(token.offset, kAnyInterval.size(), kAnyInterval);
    }
  }
  std::ranges::copy(sections.insertions(), std::back_inserter(insertions));
  std::ranges::stable_sort(insertions, {}, [](const auto& one) { return one.first; });
  TextForIec2c made = with_insertions(text, insertions);
  made.bodies = bodies.begins();
  return made;
}

std::string_view line_of(std::string_view text, unsigned line) {
  for (; line > 1 && !text.empty(); --line)
    text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
  return text.substr(0, text.find('\n'));
}

}  // namespace

JoinedSource::JoinedSource(std::span<const iec::Source> sources) {
  unsigned line = 1;
  for (const iec::Source& source : sources) {
    const auto [text, inserted, bodies] = for_iec2c(source);
    const std::size_t mark = iec::byte_order_mark(source.text);
    parts_.push_back({source.file, line, source.text.substr(mark), {}});
    for (const std::size_t begin : bodies) parts_.back().bodies.push_back(begin - mark);
    std::size_t at = 0;
    std::size_t begin = 0;  // of the line
    unsigned of_line = line;
    for (const iec::Stretch& words : inserted) {
      for (; at < words.offset; ++at) {
        if (text[at] != '\n') continue;
        begin = at + 1;
        ++of_line;
      }
      insertions_.push_back(
          {of_line, static_cast<unsigned>(words.offset - begin) + 1, static_cast<unsigned>(words.bytes)});
    }
    text_ += text;
    if (!text.ends_with('\n')) text_ += '\n';
    line += static_cast<unsigned>(std::ranges::count(text, '\n')) + (text.ends_with('\n') ? 0U : 1U);
  }
}

iec::SourcePlace JoinedSource::place(unsigned line, unsigned column) const {
  const auto after = std::ranges::upper_bound(parts_, line, {}, &Part::first_line);
  if (after == parts_.begin()) return {};
  const Part& part = *std::prev(after);
  unsigned inserted = 0;
  for (const Insertion& words : std::ranges::equal_range(insertions_, line, {}, &Insertion::line)) {
    if (words.column < column) inserted += std::min(column - words.column, words.bytes);
  }
  const unsigned of_part = line - part.first_line + 1;
  return {part.file, of_part, column <= 1 ? column : part.column(of_part, column - inserted)};
}

// In characters, of one in bytes.
unsigned JoinedSource::Part::column(unsigned of_line, unsigned bytes) const {
  const std::string_view line = line_of(source, of_line);
  const auto begin = static_cast<std::size_t>(line.data() - source.data());
  const auto body = std::ranges::lower_bound(bodies, begin);
  if (body != bodies.end() && *body - begin < line.size() && bytes > *body - begin + 1) --bytes;
  const std::string_view before = line.substr(0, bytes - 1);
  return iec::characters_in(before) + bytes - static_cast<unsigned>(before.size());
}

}  // namespace plchost::matiec
