#include "instances/adapters/plcopen/declarations.hpp"

#include <algorithm>
#include <array>
#include <ranges>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "instances/adapters/iec/tokens.hpp"
#include "shm/base/names.hpp"

namespace plchost::plcopen {

namespace {

using pugi::xml_node;

constexpr std::array<std::string_view, 20> kElementary{
    "BOOL", "BYTE",  "WORD",  "DWORD", "LWORD", "SINT", "INT",   "DINT", "LINT", "USINT",
    "UINT", "UDINT", "ULINT", "REAL",  "LREAL", "TIME", "LTIME", "DATE", "DT",   "TOD"};

/// Something that stands in ST as it stands in an attribute: nothing else may come with it.
bool is_one_value(std::string_view text) {
  const iec::Tokens tokens = iec::tokens_of(text, "");
  return tokens.problems.empty() && tokens.new_comments.empty() && tokens.all.size() > 1 &&
         std::ranges::none_of(tokens.all, [](const iec::Token& token) {
           return token.is(";") || token.is(":") || token.kind == iec::Token::Kind::pragma;
         });
}

std::string one_line(std::string_view text) {
  std::string result(text);
  std::ranges::replace_if(result, [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return result;
}

class Types {
 public:
  Types(ProjectFile& file, std::string_view where) : file_(file), where_(where) {}

  std::string in(const xml_node& parent, int depth) {
    if (depth > kMostDepth) return refuse(parent, fmt::format("types are nested deeper than {}", kMostDepth));
    std::vector<xml_node> elements;
    for (const xml_node& child : parent.children()) {
      const std::string_view name = file_.name_of(child);
      if (child.type() == pugi::node_element && name != "addData" && name != "documentation")
        elements.push_back(child);
    }
    if (elements.size() != 1) return refuse(parent, "it has no type, or several");
    return of(elements.front(), depth);
  }

 private:
  std::string refuse(const xml_node& element, std::string_view why) {
    file_.refuse(element, fmt::format("{}: {}", where_, why));
    return "";
  }
  std::string of(const xml_node& type, int depth) {
    std::string name(file_.name_of(type));
    if (is_elementary(name)) return name;
    if (name == "string" || name == "wstring") return text_type(type, iec::folded(name));
    if (name == "derived") return file_.identifier(type, "name", where_);
    if (name == "array") return array(type, depth);
    if (name == "enum") return enumeration(type);
    if (name == "struct") return structure(type, depth);
    if (name == "subrangeSigned" || name == "subrangeUnsigned") return subrange(type, depth);
    return refuse(type, fmt::format("<{}> is no type that can be taken; allowed are {}, string, wstring, "
                                    "array, derived, enum, struct and subranges",
                                    shown(name), fmt::join(kElementary, ", ")));
  }
  // A number, or an expression of constants.
  std::string bound(const xml_node& element, const char* attribute) {
    std::string text = one_line(element.attribute(attribute).value());
    if (is_one_value(text) && text.find_first_of(",[]") == std::string::npos) return text;
    return refuse(element, fmt::format("'{}' is not allowed as its {}", shown(text), attribute));
  }
  std::string text_type(const xml_node& type, const std::string& name) {
    if (type.attribute("length").empty()) return name;
    return fmt::format("{}[{}]", name, bound(type, "length"));
  }
  std::string range(const xml_node& element) {
    return fmt::format("{}..{}", bound(element, "lower"), bound(element, "upper"));
  }
  std::string array(const xml_node& type, int depth) {
    std::vector<std::string> dimensions;
    std::string base;
    file_.read(type, where_,
               {{"dimension", [&](const xml_node& one) { dimensions.push_back(range(one)); }},
                {"baseType", [&](const xml_node& one) { base = in(one, depth + 1); }}});
    if (dimensions.empty()) return refuse(type, "an array has no dimension");
    return base.empty() ? "" : fmt::format("ARRAY[{}] OF {}", fmt::join(dimensions, ", "), base);
  }
  std::string subrange(const xml_node& type, int depth) {
    std::string limits;
    std::string base;
    file_.read(type, where_,
               {{"range", [&](const xml_node& one) { limits = range(one); }},
                {"baseType", [&](const xml_node& one) { base = in(one, depth + 1); }}});
    if (limits.empty()) return refuse(type, "a subrange has no range");
    return base.empty() ? "" : fmt::format("{} ({})", base, limits);
  }
  // Values that count up from 0 are those that it has without them.
  std::string enumeration(const xml_node& type) {
    std::vector<std::string> names;
    std::vector<std::string> with_values;
    bool counts_up = true;
    const auto take = [&](const xml_node& value) {
      const std::string text = value.attribute("value").value();
      counts_up = counts_up && (text.empty() || text == std::to_string(names.size()));
      names.push_back(file_.identifier(value, "name", where_));
      with_values.push_back(text.empty() ? names.back()
                                         : fmt::format("{} := {}", names.back(), bound(value, "value")));
    };
    const auto base = [&](const xml_node& one) {
      if (in(one, 0) != "INT") refuse(one, "an enumeration with another base type than INT is not taken");
    };
    file_.read(type, where_,
               {{"values", [&](const xml_node& values) { file_.read(values, where_, {{"value", take}}); }},
                {"baseType", base}});
    if (names.empty()) return refuse(type, "an enumeration has no values");
    return fmt::format("({})", fmt::join(counts_up ? names : with_values, ", "));
  }
  std::string structure(const xml_node& type, int depth) {
    std::string members;
    file_.read(type, where_, {{"variable", [&](const xml_node& variable) {
                                 members += declaration_of(file_, variable, where_, depth + 1) + " ";
                               }}});
    if (members.empty()) return refuse(type, "a structure has no members");
    return fmt::format("STRUCT {}END_STRUCT", members);
  }

  ProjectFile& file_;
  std::string_view where_;
};

class Values {
 public:
  Values(ProjectFile& file, std::string_view where) : file_(file), where_(where) {}

  /// `quote`: of a text that may stand without one; 0: it is none.
  std::string in(const xml_node& parent, char quote, int depth) {
    if (depth > kMostDepth)
      return refuse(parent, fmt::format("values are nested deeper than {}", kMostDepth));
    std::vector<std::string> values;
    file_.read(parent, where_,
               {{"simpleValue", [&](const xml_node& one) { values.push_back(simple(one, quote)); }},
                {"arrayValue", [&](const xml_node& one) { values.push_back(array(one, quote, depth)); }},
                {"structValue", [&](const xml_node& one) { values.push_back(structure(one, depth)); }}});
    if (values.size() == 1) return values.front();
    return refuse(parent, "it has no value, or several");
  }

 private:
  std::string refuse(const xml_node& element, std::string_view why) {
    file_.refuse(element, fmt::format("{}: {}", where_, why));
    return "";
  }
  // Beremiz leaves the quotes of texts out.
  std::string simple(const xml_node& element, char quote) {
    std::string text = one_line(element.attribute("value").value());
    if (quote != 0 && !text.starts_with(quote)) {
      std::string quoted;
      for (const char c : text) quoted += c == quote ? std::string{'$', c} : std::string{c};
      text = fmt::format("{}{}{}", quote, quoted, quote);
    }
    if (is_one_value(text)) return text;
    return refuse(element, fmt::format("'{}' is no value", shown(text)));
  }
  std::string array(const xml_node& element, char quote, int depth) {
    std::vector<std::string> values;
    file_.read(element, where_, {{"value", [&](const xml_node& one) {
                                    const std::string value = in(one, quote, depth + 1);
                                    const std::string times = one.attribute("repetitionValue").value();
                                    const bool once = times.empty() || times == "1";
                                    if (!once && !is_one_value(times)) refuse(one, "its repetitionValue");
                                    values.push_back(once ? value : fmt::format("{}({})", times, value));
                                  }}});
    return fmt::format("[{}]", fmt::join(values, ", "));
  }
  std::string structure(const xml_node& element, int depth) {
    std::vector<std::string> values;
    file_.read(element, where_, {{"value", [&](const xml_node& one) {
                                    const std::string member = file_.identifier(one, "member", where_);
                                    values.push_back(fmt::format("{} := {}", member, in(one, 0, depth + 1)));
                                  }}});
    return fmt::format("({})", fmt::join(values, ", "));
  }

  ProjectFile& file_;
  std::string_view where_;
};

/// Of the texts in a type: 'a', "a" of WSTRING.
char quote_of(const ProjectFile& file, const xml_node& parent) {
  xml_node at = parent;
  for (int depth = 0; depth <= kMostDepth; ++depth) {
    for (const xml_node& child : at.children()) {
      const std::string_view name = file.name_of(child);
      if (name == "string") return '\'';
      if (name == "wstring") return '"';
      if (name == "array" || name == "baseType") at = child;
    }
  }
  return 0;
}

// PERSISTENT is no word of iec2c. A value that survives more than a restart survives a restart.
std::string qualifiers_of(ProjectFile& file, const xml_node& list, std::string_view where) {
  std::string result;
  if (is_true(list, "constant")) result += " CONSTANT";
  const bool persistent = is_true(list, "persistent");
  if (is_true(list, "retain") || persistent) result += " RETAIN";
  if (is_true(list, "nonretain")) result += " NON_RETAIN";
  if (persistent)
    file.remark(list, fmt::format("{}: PERSISTENT is carried out as RETAIN; a cold reset brings the initial "
                                  "values back",
                                  where));
  return result;
}

}  // namespace

bool is_elementary(std::string_view type) noexcept {
  return std::ranges::find(kElementary, type) != kElementary.end();
}

bool is_true(const xml_node& element, const char* attribute) {
  const std::string_view value = element.attribute(attribute).value();
  return value == "true" || value == "1";
}

std::string type_in(ProjectFile& file, const xml_node& parent, std::string_view where, int depth) {
  return Types(file, where).in(parent, depth);
}

std::string value_in(ProjectFile& file, const xml_node& parent, const xml_node& type,
                     std::string_view where) {
  return Values(file, where).in(parent, quote_of(file, type), 0);
}

std::string declaration_of(ProjectFile& file, const xml_node& variable, std::string_view where, int depth) {
  const std::string name = file.identifier(variable, "name", where);
  const std::string what = fmt::format("{}: {}", where, name);
  xml_node type;
  xml_node value;
  file.read(variable, what,
            {{"type", [&](const xml_node& one) { type = one; }},
             {"initialValue", [&](const xml_node& one) { value = one; }}});
  if (!type) file.refuse(variable, fmt::format("{} has no type", what));
  std::string text = name;
  if (const std::string address = variable.attribute("address").value(); !address.empty()) {
    const iec::Tokens tokens = iec::tokens_of(address, "");
    if (tokens.all.size() != 2 || tokens.all.front().kind != iec::Token::Kind::place)
      file.refuse(variable, fmt::format("{}: '{}' is no address; allowed are those like %IX0.0 and %QW1",
                                        what, shown(address)));
    text += " AT " + one_line(address);
  }
  if (type) text += " : " + type_in(file, type, what, depth);
  if (value) text += " := " + value_in(file, value, type, what);
  return text + ";";
}

void add_section(ProjectFile& file, const xml_node& list, std::string_view keyword, std::string_view where,
                 GeneratedText& text) {
  std::vector<std::pair<std::string, unsigned>> lines;
  file.read(list, where, {{"variable", [&](const xml_node& variable) {
                             lines.emplace_back(declaration_of(file, variable, where),
                                                file.line_of(variable));
                           }}});
  if (lines.empty()) return;
  text.add(fmt::format("{}{}", keyword, qualifiers_of(file, list, where)), file.line_of(list));
  for (const auto& [line, xml_line] : lines) text.add(line, xml_line);
  text.add("END_VAR", lines.back().second);
}

}  // namespace plchost::plcopen
