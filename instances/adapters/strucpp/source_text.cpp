#include "instances/adapters/strucpp/source_text.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/place.hpp"
#include "instances/adapters/iec/pragmas.hpp"
#include "instances/adapters/iec/tokens.hpp"

namespace plchost::strucpp {

namespace {

using iec::folded;
using iec::Token;

void blank(std::string& text, std::size_t begin, std::size_t end) {
  for (char& c : std::span(text).subspan(begin, end - begin)) {
    if (c != '\n' && c != '\r') c = ' ';
  }
}

std::size_t end_of(const Token& token) {
  return token.offset + token.text.size();
}

/// Without pragmas of other tools.
std::vector<Token> tokens_in(const iec::Source& source) {
  std::vector<Token> tokens = iec::tokens_of(source.text, source.file).all;
  std::erase_if(tokens, iec::is_of_other_tools);
  return tokens;
}

/// Changes the text from token to token. Insertions come last, as they move what is behind them.
class Rewriter {
 public:
  Rewriter(const iec::Source& source, const std::set<std::string>& enumerations, const Constants& constants)
      : tokens_(iec::tokens_of(source.text, source.file).all),
        enumerations_(enumerations),
        constants_(constants) {
    made_.text = source.text;
    for (const Token& token : tokens_) {
      if (iec::is_of_other_tools(token)) blank(made_.text, token.offset, end_of(token));
    }
    std::erase_if(tokens_, iec::is_of_other_tools);
  }

  SourceText run() {
    read_globals();
    for (next_ = 0; !at_end(); ++next_) {
      const Token& token = tokens_[next_];
      if (token.kind == Token::Kind::literal) name_by_dot(token);
      if (token.is("PROGRAM")) in_program_ = true;
      if (token.is("END_PROGRAM")) in_program_ = false;
      if (token.is("CONFIGURATION")) read_configuration();
      if (token.is("VAR_EXTERNAL") && this->token(1).is("CONSTANT")) give_values();
      if (in_program_ && is_section(token)) read_section([](const iec::Location&) { return true; });
    }
    hide_places();
    move_resource();
    insert();
    return std::move(made_);
  }

 private:
  [[nodiscard]] const Token& token(std::size_t ahead = 0) const {
    return tokens_[std::min(next_ + ahead, tokens_.size() - 1)];
  }
  [[nodiscard]] bool at_end() const { return token().kind == Token::Kind::end; }
  [[nodiscard]] static bool is_section(const Token& token) {
    return token.is("VAR") || token.is("VAR_INPUT") || token.is("VAR_OUTPUT");
  }

  // Mode#busy is Mode.busy for the compiler.
  [[nodiscard]] std::string with_dot(std::string literal) const {
    const std::size_t sharp = literal.find('#');
    if (sharp != std::string::npos && enumerations_.contains(folded(literal.substr(0, sharp))))
      literal[sharp] = '.';
    return literal;
  }
  void name_by_dot(const Token& token) {
    made_.text.replace(token.offset, token.text.size(), with_dot(token.text));
  }

  // VAR RETAIN a, b AT %QX0.1 : BOOL; ... END_VAR. `hides`: whether the compiler is not to see a location.
  template <class Hides>
  void read_section(const Hides& hides) {
    ++next_;
    while (token().is("RETAIN") || token().is("NON_RETAIN") || token().is("CONSTANT")) ++next_;
    const Token* first = &token();  // of the declaration
    for (; !at_end() && !token().is("END_VAR"); ++next_) {
      if (token().kind == Token::Kind::literal) name_by_dot(token());
      if (token().is(";")) first = &token(1);
      if (!token().is("AT") || token(1).kind != Token::Kind::place) continue;
      const auto location = iec::location_of(token(1).text);
      if (location && hides(*location)) places_.push_back({first, &token(), &token(1)});
    }
  }

  // Those of several numbers: the compiler refuses them.
  void read_globals() {
    for (next_ = 0; !at_end(); ++next_) {
      if (token().is("VAR_GLOBAL"))
        read_section([](const iec::Location& location) { return !location.is_direct(); });
    }
  }

  // VAR_EXTERNAL CONSTANT limit : INT; END_VAR: the value is that of the global, whatever stands here. But it
  // is also used where the compiler needs one itself.
  void give_values() {
    const Token* first = &token(2);  // of the declaration
    for (next_ += 2; !at_end() && !token().is("END_VAR"); ++next_) {
      if (!token().is(";")) continue;
      const auto value = constants_.find(folded(first->text));
      // Of several names each would need its own.
      const bool needs_one =
          std::none_of(first, &token(), [](const Token& one) { return one.is(":=") || one.is(","); });
      if (needs_one && value != constants_.end()) {
        insertions_.push_back(
            {token().offset, token().place.line, token().place.column, " := " + with_dot(value->second)});
      }
      first = &token(1);
    }
  }

  // If two declarations in one line begin with one name, the compiler gets both as they are.
  void hide_places() {
    std::map<std::pair<unsigned, std::string>, int> counts;
    for (const Located& place : places_) ++counts[{place.first->place.line, folded(place.first->text)}];
    for (const auto& [first, at, location] : places_) {
      std::string name = folded(first->text);
      if (counts.at({first->place.line, name}) > 1) continue;
      blank(made_.text, at->offset, end_of(*location));
      made_.places.push_back(
          {.line = first->place.line, .name = std::move(name), .location = folded(location->text)});
    }
  }

  // Of a configuration with one RESOURCE: its head is put behind its globals, which are those of the
  // configuration then.
  void read_configuration() {
    std::size_t resources = 0;
    for (; !at_end() && !token().is("END_CONFIGURATION"); ++next_) {
      if (token().is("RESOURCE") && ++resources == 1) read_resource();
      if (token().kind == Token::Kind::literal) name_by_dot(token());
    }
    if (resources != 1) head_.reset();
  }
  // RESOURCE press ON PLC
  void read_resource() {
    if (!token(2).is("ON")) return;
    const Token* const first = &token();
    const Token* const last = &token(3);
    next_ += 3;
    const Token* behind = nullptr;
    while (token(1).is("VAR_GLOBAL")) {
      for (++next_; !at_end() && !token().is("END_VAR"); ++next_) {
        if (token().kind == Token::Kind::literal) name_by_dot(token());
      }
      behind = &token();
    }
    if (behind != nullptr && behind->is("END_VAR")) head_ = Head{first, last, behind};
  }
  void move_resource() {
    if (!head_) return;
    const Token& name = *(head_->first + 1);
    const std::string words = fmt::format(" RESOURCE {} ON {}", name.text, head_->last->text);
    blank(made_.text, head_->first->offset, end_of(*head_->last));
    const Token& behind = *head_->behind;
    insertions_.push_back(
        {end_of(behind), behind.place.line, behind.place.column + iec::characters_in(behind.text), words});
  }
  void insert() {
    std::ranges::sort(insertions_, {}, &Insertion::offset);
    std::size_t moved = 0;
    for (const auto& [offset, line, column, words] : insertions_) {
      made_.text.insert(offset + moved, words);
      moved += words.size();
      made_.inserted.push_back({.line = line, .column = column, .characters = iec::characters_in(words)});
    }
  }

  struct Insertion {
    std::size_t offset;  // in the source, as line and column
    unsigned line;
    unsigned column;
    std::string words;
  };

  struct Located {
    const Token* first;
    const Token* at;
    const Token* location;
  };
  struct Head {
    const Token* first;
    const Token* last;
    const Token* behind;  // the END_VAR of its globals
  };

  std::vector<Token> tokens_;
  const std::set<std::string>& enumerations_;
  const Constants& constants_;
  std::vector<Insertion> insertions_;
  std::size_t next_ = 0;
  bool in_program_ = false;
  std::vector<Located> places_;
  std::optional<Head> head_;
  SourceText made_;
};

}  // namespace

std::set<std::string> enumerations_in(std::span<const iec::Source> sources) {
  std::set<std::string> names;
  for (const iec::DeclaredType& type : iec::read_project(sources).project.types) {
    const std::string name = folded(type.name);
    if (type.definition.starts_with(name + " : (")) names.insert(name);
  }
  return names;
}

Constants constants_in(std::span<const iec::Source> sources) {
  Constants constants;
  for (const iec::Source& source : sources) {
    const std::vector<Token> tokens = tokens_in(source);
    bool in_section = false;
    std::vector<std::string> names;  // of a declaration
    for (std::size_t i = 0; i + 1 < tokens.size(); ++i) {
      if (tokens[i].is("VAR_GLOBAL")) in_section = tokens[i + 1].is("CONSTANT");
      if (tokens[i].is("END_VAR")) in_section = false;
      if (!in_section) continue;
      if (tokens[i].is(";") || tokens[i].is("CONSTANT")) names.clear();
      if (tokens[i].kind == Token::Kind::name && (tokens[i + 1].is(",") || tokens[i + 1].is(":")))
        names.push_back(folded(tokens[i].text));
      if (!tokens[i].is(":=")) continue;
      std::string value;
      for (++i; i + 1 < tokens.size() && !tokens[i].is(";"); ++i)
        value += (value.empty() ? "" : " ") + tokens[i].text;
      for (const std::string& name : names) constants.emplace(name, value);
      names.clear();
    }
  }
  return constants;
}

SourceText text_for_strucpp(const iec::Source& source, const std::set<std::string>& enumerations,
                            const Constants& constants) {
  return Rewriter(source, enumerations, constants).run();
}

}  // namespace plchost::strucpp
