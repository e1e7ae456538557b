#include "instances/adapters/plcopen/write_elements.hpp"

#include <algorithm>
#include <string_view>
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

/// Words of ST that MATIEC or STruC++ takes for no name of a variable.
constexpr std::string_view kWords =
    " ABSTRACT ACTION AND ANY ANY_BIT ANY_DATE ANY_DERIVED ANY_ELEMENTARY ANY_INT ANY_MAGNITUDE"
    " ANY_NUM ANY_REAL ANY_STRING ARRAY AT BOOL BY BYTE CASE CONFIGURATION CONSTANT CONTINUE DATE"
    " DATE_AND_TIME DINT DO DREF DT DWORD ELSE ELSIF EN END_ACTION END_CASE END_CONFIGURATION END_FOR"
    " END_FUNCTION END_FUNCTION_BLOCK END_GET END_IF END_INTERFACE END_METHOD END_PROGRAM END_PROPERTY"
    " END_REPEAT END_RESOURCE END_SET END_STEP END_STRUCT END_TRANSITION END_TYPE END_VAR END_WHILE"
    " ENO EXIT EXTENDS FALSE FINAL FOR FROM FUNCTION FUNCTION_BLOCK F_EDGE IF IMPLEMENTS INITIAL_STEP"
    " INT INTERFACE INTERVAL LINT LREAL LTIME LWORD METHOD MOD NON_RETAIN NOT NULL OF ON OR OVERRIDE"
    " POINTER PRIORITY PRIVATE PROGRAM PROPERTY PROTECTED PUBLIC READ_ONLY READ_WRITE REAL REF"
    " REFERENCE_TO REF_TO REPEAT RESOURCE RETAIN RETURN R_EDGE SINGLE SINT STEP STRING STRUCT SUPER"
    " TASK THEN THIS TIME TIME_OF_DAY TO TOD TRANSITION TRUE TYPE UDINT UINT ULINT UNTIL USINT VAR"
    " VAR_ACCESS VAR_CONFIG VAR_EXTERNAL VAR_GLOBAL VAR_INPUT VAR_INST VAR_IN_OUT VAR_OUTPUT VAR_TEMP"
    " WHILE WITH WORD WSTRING XOR"
    " ";

bool is_word(std::string_view name) {
  return kWords.contains(fmt::format(" {} ", folded(std::string(name))));
}

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
  // iec2c knows no name with two of them in a row, nor one that ends with one.
  const auto repeated = std::ranges::unique(result, [](char a, char b) { return a == '_' && b == '_'; });
  result.erase(repeated.begin(), repeated.end());
  while (result.ends_with('_')) result.pop_back();
  if (result.empty()) result = "1";
  if (!is_identifier(result) || is_word(result)) result.insert(0, 1, '_');
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
