#include "instances/adapters/plcopen/write_elements.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/plcopen/declarations.hpp"
#include "instances/adapters/plcopen/project_file.hpp"
#include "shm/base/names.hpp"

namespace plchost::plcopen {

namespace {

using iec::folded;
using pugi::xml_node;

/// Of the data that plchost adds to a task.
constexpr const char* kTaskData = "https://plchost/task";
constexpr const char* kTaskElement = "PlchostTask";

/// The words of a type in ST, as PLCopen has them.
class TypeElements {
 public:
  explicit TypeElements(std::string_view type) : tokens_(iec::tokens_of(type, "").all) {}

  void add_to(xml_node parent) {
    for (int depth = 0; depth < kMostDepth && take("ARRAY"); ++depth) {
      xml_node array = parent.append_child("array");
      take("[");
      do {
        const xml_node dimension = array.append_child("dimension");
        set(dimension, "lower", take_until(".."));
        take("..");
        set(dimension, "upper", take_until(","));
      } while (take(","));
      take("]");
      take("OF");
      parent = array.append_child("baseType");
    }
    add_simple(parent);
  }

 private:
  [[nodiscard]] bool at(std::string_view word) const { return tokens_[next_].is(word); }
  [[nodiscard]] bool at_end() const { return tokens_[next_].kind == iec::Token::Kind::end; }
  bool take(std::string_view word) {
    const bool is_here = at(word);
    if (is_here) ++next_;
    return is_here;
  }
  std::string take_until(std::string_view word) {
    std::string text;
    while (!at_end() && !at(word) && !at("]") && !at(")")) text += tokens_[next_++].text;
    return text;
  }
  void add_simple(xml_node parent) {
    const std::string name = at_end() ? "" : folded(tokens_[next_++].text);
    if (name == "STRING" || name == "WSTRING") {
      const xml_node text = parent.append_child(name == "STRING" ? "string" : "wstring");
      if (take("[") || take("(")) set(text, "length", take_until(""));
    } else if (is_elementary(name) && take("(")) {
      xml_node subrange = parent.append_child(name.starts_with('U') ? "subrangeUnsigned" : "subrangeSigned");
      const xml_node range = subrange.append_child("range");
      set(range, "lower", take_until(".."));
      take("..");
      set(range, "upper", take_until(""));
      subrange.append_child("baseType").append_child(name.c_str());
    } else if (is_elementary(name)) {
      parent.append_child(name.c_str());
    } else {
      add(parent, "derived", Names().of(next_ == 0 ? "" : tokens_[next_ - 1].text));
    }
  }

  std::vector<iec::Token> tokens_;
  std::size_t next_ = 0;
};

}  // namespace

void set(xml_node element, const char* attribute, const std::string& value) {
  element.append_attribute(attribute) = value.c_str();
}

xml_node add(xml_node parent, const char* element, const std::string& name) {
  xml_node child = parent.append_child(element);
  set(child, "name", name);
  return child;
}

std::string Names::of(std::string_view name) {
  std::string result(name.empty() ? "_" : name);
  std::ranges::replace_if(result, [](char c) { return !is_identifier(std::string{'_', c}); }, '_');
  if (!is_identifier(result)) result.insert(0, 1, '_');
  std::string unique = result;
  for (unsigned number = 2; !taken_.insert(folded(unique)).second; ++number)
    unique = fmt::format("{}_{}", result, number);
  return unique;
}

void document(xml_node element, const std::string& text) {
  if (text.empty()) return;
  element.append_child("documentation").append_child("xhtml:p").text() = printable(text).c_str();
}

std::string told_name(std::string_view name, std::string_view written) {
  return name == written ? "" : fmt::format("its name in plchost is {}", name);
}

void add_external_event(xml_node task, const std::string& event) {
  xml_node data = add(task.append_child("addData"), "data", kTaskData);
  set(data, "handleUnknown", "preserve");
  set(data.append_child(kTaskElement), "external_event", printable(event));
}

std::string external_event_of(const xml_node& task) {
  const xml_node data = task.child("addData").find_child_by_attribute("name", kTaskData);
  return data.child(kTaskElement).attribute("external_event").value();
}

void add_type(xml_node parent, std::string_view type) {
  TypeElements(type).add_to(parent);
}

}  // namespace plchost::plcopen
