#include "instances/adapters/plcopen/pous.hpp"

#include <algorithm>
#include <array>
#include <ranges>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/plcopen/declarations.hpp"
#include "shm/base/names.hpp"

namespace plchost::plcopen {

namespace {

using pugi::xml_node;

struct PouKind {
  std::string_view name;
  std::string_view begin;
  std::string_view end;
};
constexpr std::array<PouKind, 3> kPouKinds{
    {{.name = "program", .begin = "PROGRAM", .end = "END_PROGRAM"},
     {.name = "functionBlock", .begin = "FUNCTION_BLOCK", .end = "END_FUNCTION_BLOCK"},
     {.name = "function", .begin = "FUNCTION", .end = "END_FUNCTION"}}};

/// The lines of a text that is formatted by XHTML.
class FormattedText {
 public:
  FormattedText(ProjectFile& file, std::string_view where) : file_(file), where_(where) {}

  std::vector<BodyLine> lines_in(const xml_node& text) {
    take(text, 0);
    return std::move(lines_);
  }

 private:
  void take(const xml_node& parent, int depth) {
    if (depth > kMostDepth)
      return file_.refuse(parent, fmt::format("{}: elements are nested deeper than {}", where_, kMostDepth));
    for (const xml_node& child : parent.children()) {
      if (child.type() == pugi::node_element) {
        take_element(child, depth);
      } else {
        add(child.value(), file_.lines_of(child));
      }
    }
  }
  void take_element(const xml_node& element, int depth) {
    constexpr std::array<std::string_view, 4> kInline{"span", "b", "i", "em"};
    constexpr std::array<std::string_view, 7> kLines{"xhtml", "html", "body", "p", "div", "pre", "br"};
    std::string_view name = element.name();
    name = name.substr(name.find(':') + 1);  // npos + 1: all of it
    const bool is_inline = std::ranges::find(kInline, name) != kInline.end();
    if (!is_inline && std::ranges::find(kLines, name) == kLines.end())
      return file_.refuse(element, fmt::format("{}: <{}> is not understood in a body", where_, shown(name)));
    if (!is_inline) is_open_ = false;
    take(element, depth + 1);
    if (!is_inline) is_open_ = false;
  }
  void add(std::string_view text, const std::vector<unsigned>& places) {
    std::size_t number = 0;
    for (const auto part : std::views::split(text, '\n')) {
      const std::string_view line(part.begin(), part.end());
      const unsigned place = places[std::min(number++, places.size() - 1)];
      if (is_open_ && number == 1) {
        lines_.back().text += line;
      } else {
        lines_.push_back({std::string(line), place});
      }
    }
    is_open_ = true;
  }

  ProjectFile& file_;
  std::string_view where_;
  std::vector<BodyLine> lines_;
  bool is_open_ = false;  // the last line goes on
};

class PouReader {
 public:
  PouReader(ProjectFile& file, GeneratedText& text) : file_(file), text_(text) {}

  void add(const xml_node& pou) {
    const std::string name = file_.identifier(pou, "name", "a POU");
    where_ = "POU " + name;
    const std::string_view type = pou.attribute("pouType").value();
    const auto* const kind = std::ranges::find(kPouKinds, type, &PouKind::name);
    if (kind == kPouKinds.end())
      return file_.refuse(pou,
                          fmt::format("{}: pouType '{}' is not allowed; allowed are program, functionBlock "
                                      "and function",
                                      where_, shown(type)));
    is_function_ = kind->name == "function";
    xml_node interface;
    std::vector<xml_node> bodies;
    file_.read(pou, where_,
               {{"interface", [&](const xml_node& one) { interface = one; }},
                {"body", [&](const xml_node& one) { bodies.push_back(one); }},
                {"actions", [&](const xml_node& one) { refuse_parts(one, "action"); }},
                {"transitions", [&](const xml_node& one) { refuse_parts(one, "transition"); }}});
    text_.add(fmt::format("{} {}{}", kind->begin, name, return_type(pou, interface)), file_.line_of(pou));
    add_sections(interface);
    // MATIEC takes no POU without a variable.
    if (!has_variable(interface)) text_.add("VAR plchost_no_variable : BOOL; END_VAR", file_.line_of(pou));
    if (bodies.size() == 1) {
      add_body(bodies.front(), name);
    } else {
      refuse_bodies(pou, bodies.size());
    }
    text_.end_body(kind->end);
  }

 private:
  void refuse(const xml_node& element, std::string_view why) {
    file_.refuse(element, fmt::format("{}: {}", where_, why));
  }
  void refuse_bodies(const xml_node& pou, std::size_t count) {
    if (count > 1) return refuse(pou, "it has several bodies; one in ST is taken");
    refuse(pou, "it has no body; the export of a running instance has none");
  }
  void refuse_parts(const xml_node& parts, std::string_view what) {
    file_.read(parts, where_, {{what, [&](const xml_node& part) {
                                  refuse(part, fmt::format("{} {} is not taken; only a body in ST is", what,
                                                           shown(part.attribute("name").value())));
                                }}});
  }
  std::string return_type(const xml_node& pou, const xml_node& interface) {
    xml_node type;
    for (const xml_node& child : interface.children()) {
      if (file_.name_of(child) == "returnType") type = child;
    }
    if (type && !is_function_) refuse(type, "only a function has a returnType");
    if (!type && is_function_) refuse(pou, "a function has a returnType");
    return type ? " : " + type_in(file_, type, where_) : "";
  }
  [[nodiscard]] bool has_variable(const xml_node& interface) const {
    return std::ranges::any_of(interface.children(), [&](const xml_node& section) {
      return std::ranges::any_of(section.children(),
                                 [&](const xml_node& child) { return file_.name_of(child) == "variable"; });
    });
  }
  void add_sections(const xml_node& interface) {
    const auto section = [&](std::string_view keyword) {
      return [this, keyword](const xml_node& list) { add_section(file_, list, keyword, where_, text_); };
    };
    file_.read(interface, where_,
               {{"localVars", section("VAR")},
                {"tempVars", section("VAR_TEMP")},
                {"inputVars", section("VAR_INPUT")},
                {"outputVars", section("VAR_OUTPUT")},
                {"inOutVars", section("VAR_IN_OUT")},
                {"externalVars", section("VAR_EXTERNAL")},
                {"returnType", [](const xml_node&) {}}});
  }
  void add_body(const xml_node& body, const std::string& pou) {
    xml_node source;
    const auto other = [&](const xml_node& one) {
      refuse(one, fmt::format("its body is in {}; only ST is taken", file_.name_of(one)));
      source = one;
    };
    file_.read(body, where_,
               {{"ST", [&](const xml_node& one) { source = one; }},
                {"IL", other},
                {"FBD", other},
                {"LD", other},
                {"SFC", other}});
    if (!source) return refuse(body, "its body is in no language; ST is taken");
    if (file_.name_of(source) != "ST") return;
    std::vector<BodyLine> lines = FormattedText(file_, where_).lines_in(source);
    if (lines.empty()) lines.push_back({"", file_.line_of(source)});
    if (has_no_statement(lines))
      file_.remark(source, fmt::format("{}: its body has no statement, so it does nothing", where_));
    text_.add_body(lines, pou);
  }
  static bool has_no_statement(const std::vector<BodyLine>& lines) {
    std::string body;
    for (const BodyLine& line : lines) body += line.text + "\n";
    return std::ranges::all_of(iec::tokens_of(body, "").all, [](const iec::Token& token) {
      return token.is(";") || token.is("RETURN") || token.kind == iec::Token::Kind::end;
    });
  }

  ProjectFile& file_;
  GeneratedText& text_;
  std::string where_;
  bool is_function_ = false;
};

/// The only <struct> in it; null: it is of another type.
xml_node structure_in(const ProjectFile& file, const xml_node& base) {
  const xml_node type = base.find_child([](const xml_node& one) { return one.type() == pugi::node_element; });
  return file.name_of(type) == "struct" ? type : xml_node();
}

}  // namespace

void add_pou(ProjectFile& file, const xml_node& pou, GeneratedText& text) {
  PouReader(file, text).add(pou);
}

void add_data_type(ProjectFile& file, const xml_node& type, GeneratedText& text) {
  const std::string name = file.identifier(type, "name", "a data type");
  const std::string where = "data type " + name;
  xml_node base;
  xml_node value;
  file.read(type, where,
            {{"baseType", [&](const xml_node& one) { base = one; }},
             {"initialValue", [&](const xml_node& one) { value = one; }}});
  if (!base) return file.refuse(type, fmt::format("{} has no baseType", where));
  const unsigned line = file.line_of(type);
  text.add("TYPE", line);
  const std::string initial = value ? " := " + value_in(file, value, base, where) : "";
  if (const xml_node structure = structure_in(file, base)) {
    // Each member on a line of its own, so that errors tell which one.
    text.add(fmt::format("{} : STRUCT", name), line);
    file.read(structure, where, {{"variable", [&](const xml_node& member) {
                                    text.add(declaration_of(file, member, where), file.line_of(member));
                                  }}});
    text.add(fmt::format("END_STRUCT{};", initial), line);
  } else {
    text.add(fmt::format("{} : {}{};", name, type_in(file, base, where), initial), line);
  }
  text.add("END_TYPE", line);
}

}  // namespace plchost::plcopen
