#include "instances/adapters/plcopen/project_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <ranges>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "instances/adapters/iec/tokens.hpp"
#include "shm/base/names.hpp"

namespace plchost::plcopen {

namespace {

using pugi::xml_node;

// pugixml expands no entities of a document and reads no other files.
constexpr unsigned kParse = pugi::parse_default | pugi::parse_declaration;
constexpr std::array<std::string_view, 2> kNameSpaces{"http://www.plcopen.org/xml/tc6_0201",
                                                      "http://www.plcopen.org/xml/tc6_0200"};

/// Of CODESYS: elements that it adds, and that are a part of the program.
constexpr std::array<std::string_view, 3> kAddedParts{"pou", "dataType", "globalVars"};
constexpr std::array<std::string_view, 8> kAddedMeaning{
    "Method", "Property", "Inheritance", "Interface", "InputAssignments", "CFC", "Action", "Transition"};

template <std::size_t N>
bool contains(const std::array<std::string_view, N>& names, std::string_view name) noexcept {
  return std::ranges::find(names, name) != names.end();
}

/// "\r\n" and "\r" become "\n", as XML reads them.
std::string with_unix_lines(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\r') {
      result += text[i];
    } else if (i + 1 == text.size() || text[i + 1] != '\n') {
      result += '\n';
    }
  }
  return result;
}

/// Whether the text begins with a reference to the character of a new line: "&#10;", "&#xA;".
bool begins_with_new_line(std::string_view text) noexcept {
  if (!text.starts_with("&#")) return false;
  text.remove_prefix(2);
  const bool is_hex = text.starts_with('x');
  if (is_hex) text.remove_prefix(1);
  unsigned code = 0;
  const char* const end = text.data() + text.size();
  // NOLINTNEXTLINE(bugprone-suspicious-stringview-data-usage): `end` is the size
  const auto read = std::from_chars(text.data(), end, code, is_hex ? 16 : 10);
  return read.ec == std::errc() && code == '\n' && read.ptr != end && *read.ptr == ';';
}

bool is_utf8(std::string_view encoding) {
  return encoding.empty() || iec::folded(encoding) == "UTF-8" || iec::folded(encoding) == "US-ASCII";
}

}  // namespace

ProjectFile::ProjectFile(std::string_view text, std::string name)
    : name_(std::move(name)), text_(with_unix_lines(text)) {
  for (std::size_t at = text_.find('\n'); at != std::string::npos; at = text_.find('\n', at + 1))
    line_ends_.push_back(at);
  load();
}

void ProjectFile::load() {
  if (text_.contains('\0')) return refuse_at(0, "is no XML in UTF-8; save it as UTF-8");
  const auto parsed = document_.load_buffer(text_.data(), text_.size(), kParse, pugi::encoding_utf8);
  if (!parsed) return refuse_at(line_at(parsed.offset), fmt::format("no XML: {}", parsed.description()));
  const std::string_view encoding = document_.first_child().attribute("encoding").value();
  if (document_.first_child().type() == pugi::node_declaration && !is_utf8(encoding))
    return refuse_at(1, fmt::format("the encoding '{}' is not read; save it as UTF-8", shown(encoding)));
  find_project();
}

void ProjectFile::find_project() {
  const xml_node root = document_.document_element();
  const std::string_view name = root.name();
  const std::size_t colon = name.find(':');
  prefix_ = colon == std::string_view::npos ? "" : name.substr(0, colon + 1);
  if (name.substr(prefix_.size()) != "project")
    return refuse_at(line_of(root),
                     fmt::format("no project of PLCopen: its root is <{}>, not <project>", shown(name)));
  const std::string declaration =
      prefix_.empty() ? "xmlns" : "xmlns:" + prefix_.substr(0, prefix_.size() - 1);
  const std::string_view space = root.attribute(declaration.c_str()).value();
  if (!contains(kNameSpaces, space))
    return refuse_at(line_of(root), fmt::format("'{}' is not allowed as its name space; allowed are {}",
                                                shown(space), fmt::join(kNameSpaces, " and ")));
  project_ = root;
}

std::string_view ProjectFile::name_of(const xml_node& element) const noexcept {
  std::string_view name = element.name();
  if (name.starts_with(prefix_)) name.remove_prefix(prefix_.size());
  return name;
}

unsigned ProjectFile::line_at(std::ptrdiff_t offset) const noexcept {
  const auto at = static_cast<std::size_t>(std::max<std::ptrdiff_t>(offset, 0));
  return static_cast<unsigned>(std::ranges::lower_bound(line_ends_, at) - line_ends_.begin()) + 1;
}

unsigned ProjectFile::line_of(const xml_node& node) const noexcept {
  return line_at(node.offset_debug());
}

std::vector<unsigned> ProjectFile::lines_of(const xml_node& node) const {
  const std::ptrdiff_t offset = node.offset_debug();
  std::vector<unsigned> lines{line_at(offset)};
  if (offset < 0) return lines;
  std::string_view raw = std::string_view(text_).substr(static_cast<std::size_t>(offset));
  const bool is_text = node.type() == pugi::node_pcdata;
  raw = raw.substr(0, raw.find(is_text ? "<" : "]]>"));
  for (unsigned line = lines.front(); !raw.empty(); raw.remove_prefix(1)) {
    if (raw.front() == '\n') lines.push_back(++line);
    if (is_text && begins_with_new_line(raw)) lines.push_back(line);
  }
  return lines;
}

void ProjectFile::refuse_at(unsigned line, std::string text) {
  if (problems_.size() > kMostProblems) return;
  if (problems_.size() == kMostProblems) text = "there are further problems, which are not told";
  problems_.push_back({{name_, line, 0}, std::move(text)});
}

void ProjectFile::refuse(const xml_node& node, std::string text) {
  refuse_at(line_of(node), std::move(text));
}

void ProjectFile::remark(const xml_node& node, std::string text) {
  if (remarks_.size() < kMostProblems) remarks_.push_back({{name_, line_of(node), 0}, std::move(text)});
}

std::string ProjectFile::identifier(const xml_node& element, const char* attribute, std::string_view of) {
  const std::string_view name = element.attribute(attribute).value();
  if (is_identifier(name)) return std::string(name);
  refuse(element, fmt::format("{}: '{}' is not allowed as its {}; allowed are letters, digits and _", of,
                              shown(name), attribute));
  return "";
}

void ProjectFile::read(const xml_node& parent, std::string_view where, Handlers handlers) {
  for (const xml_node& child : parent.children()) {
    if (child.type() != pugi::node_element) continue;
    const std::string_view name = name_of(child);
    const auto* const handler = std::ranges::find(handlers, name, [](const auto& one) { return one.first; });
    if (handler != handlers.end()) {
      handler->second(child);
    } else if (name == "addData") {
      for (const xml_node& data : child.children()) read_added(data, where, handlers);
    } else if (name != "documentation") {
      refuse(child, fmt::format("{}: <{}> is not understood{}{}", where, shown(name),
                                handlers.size() == 0 ? "" : "; allowed are ",
                                fmt::join(handlers | std::views::keys, ", ")));
    }
  }
}

void ProjectFile::read_added(const xml_node& data, std::string_view where, Handlers handlers) {
  for (const xml_node& child : data.children()) {
    std::string_view name = name_of(child);
    name = name.substr(name.find(':') + 1);  // npos + 1: all of it
    const auto* const handler = std::ranges::find(handlers, name, [](const auto& one) { return one.first; });
    if (contains(kAddedParts, name) && handler != handlers.end()) {
      handler->second(child);
    } else if (contains(kAddedMeaning, name) && child.first_child()) {
      const std::string_view called = child.attribute("name").value();
      refuse(child, fmt::format("{}: {}{}{} is not taken: the compilers have no such thing", where, name,
                                called.empty() ? "" : " ", shown(called)));
    }
  }
}

bool is_identifier(std::string_view name) noexcept {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  const auto belongs = [&](char c) { return is_letter(c) || (c >= '0' && c <= '9'); };
  return !name.empty() && is_letter(name.front()) && std::ranges::all_of(name, belongs);
}

}  // namespace plchost::plcopen
