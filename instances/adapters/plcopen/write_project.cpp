#include "instances/adapters/plcopen/write_project.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <pugixml.hpp>

#include "instances/adapters/iec/place.hpp"
#include "instances/adapters/iec/tokens.hpp"
#include "instances/adapters/plcopen/iso_duration.hpp"
#include "instances/adapters/plcopen/project_file.hpp"
#include "instances/adapters/plcopen/write_elements.hpp"

namespace plchost::plcopen {

namespace {

using iec::folded;
using pugi::xml_node;

/// A variable, or a structure of those behind it.
struct Member {
  std::string name;    // "PUMP"
  std::string bounds;  // "[1..4]" of an array of structures
  const ExportedVariable* variable = nullptr;
  std::vector<Member> members;
};

// Those of one structure stand one behind the other.
Member& structure_of(std::vector<Member>& members, std::string_view word) {
  const std::size_t bracket = std::min(word.find('['), word.size());
  const std::string_view name = word.substr(0, bracket);
  const std::string_view bounds = word.substr(bracket);
  if (!members.empty() && members.back().variable == nullptr && members.back().bounds == bounds &&
      folded(members.back().name) == folded(name))
    return members.back();
  return members.emplace_back(std::string(name), std::string(bounds), nullptr, std::vector<Member>());
}

// None of those in bounds.
std::size_t dot_in(std::string_view path) {
  const std::size_t first = path.find_first_of(".[");
  if (first == std::string_view::npos || path[first] == '.') return first;
  return path.find('.', std::min(path.find(']', first), path.size()));
}

std::vector<Member> tree_of(const std::vector<ExportedVariable>& variables) {
  std::vector<Member> roots;
  for (const ExportedVariable& variable : variables) {
    std::vector<Member>* level = &roots;
    std::string_view path = variable.path;
    for (int depth = 0;; ++depth) {
      const std::size_t dot = depth < kMostDepth ? dot_in(path) : std::string_view::npos;
      if (dot == std::string_view::npos) {
        level->emplace_back(std::string(path), "", &variable, std::vector<Member>());
        break;
      }
      level = &structure_of(*level, path.substr(0, dot)).members;
      path.remove_prefix(dot + 1);
    }
  }
  return roots;
}

/// POUs and data types, each of one name and content once.
class Declared {
 public:
  void begin(xml_node types) {
    data_types_ = types.append_child("dataTypes");
    pous_ = types.append_child("pous");
  }

  /// A program with these variables, whose body does nothing; the name that it gets.
  std::string pou(const std::string& type, const std::vector<Member>& variables) {
    pugi::xml_document content;
    xml_node interface = content.append_child("interface");
    add_sections(interface, "localVars", variables);
    return name_of(type, content, [&](const std::string& name) {
      xml_node pou = add(pous_, "pou", name);
      set(pou, "pouType", "program");
      pou.append_copy(interface);
      pou.append_child("body").append_child("ST").append_child("xhtml:p").text() =
          "(* plchost does not know the body of a program. *) RETURN;";
      document(pou, told_name(type, name));
    });
  }

  /// Sections of those that are retained, constant or neither.
  void add_sections(xml_node parent, const char* section, const std::vector<Member>& members);

 private:
  template <class Add>
  std::string name_of(const std::string& wanted, const pugi::xml_document& content, Add add_one) {
    std::ostringstream text;
    content.save(text);
    const auto [known, is_new] = written_.try_emplace({folded(wanted), text.str()}, "");
    if (!is_new) return known->second;
    known->second = names_.of(wanted);
    add_one(known->second);
    return known->second;
  }
  std::string structure(const std::string& wanted, const std::vector<Member>& members) {
    pugi::xml_document content;
    xml_node structure = content.append_child("struct");
    Names own;
    for (const Member& one : members) add_variable(structure, one, own, wanted);
    return name_of(wanted, content, [&](const std::string& name) {
      add(data_types_, "dataType", name).append_child("baseType").append_copy(structure);
    });
  }
  void add_variable(xml_node list, const Member& member, Names& names, const std::string& owner) {
    const std::string name = names.of(member.name);
    xml_node variable = add(list, "variable", name);
    std::vector<std::string> words;
    if (std::string other = told_name(member.name, name); !other.empty()) words.push_back(std::move(other));
    if (const std::string address = member.variable == nullptr ? "" : member.variable->address;
        owner.empty() && iec::location_of(folded(address))) {
      set(variable, "address", address);
    } else if (!address.empty()) {
      words.push_back("it lies at " + address);
    }
    if (member.variable != nullptr && member.variable->retain && !owner.empty())
      words.emplace_back("it is retained");
    const xml_node type = variable.append_child("type");
    if (member.variable != nullptr) {
      add_type(type, member.variable->type);
    } else {
      const std::string wanted = owner.empty() ? name + "_type" : fmt::format("{}_{}", owner, name);
      const std::string of = structure(wanted, member.members);
      add_type(type, member.bounds.empty() ? of : fmt::format("ARRAY {} OF {}", member.bounds, of));
    }
    document(variable, fmt::format("{}", fmt::join(words, "; ")));
  }

  xml_node data_types_;
  xml_node pous_;
  Names names_;
  std::map<std::pair<std::string, std::string>, std::string> written_;  // by type and content: its name
};

void Declared::add_sections(xml_node parent, const char* section, const std::vector<Member>& members) {
  struct SectionKind {
    const char* attribute;
    bool retain, constant, located;  // iec2c wants sections of their own for located variables
  };
  constexpr std::array<SectionKind, 6> kSectionKinds{{{nullptr, false, false, false},
                                                      {"retain", true, false, false},
                                                      {"constant", false, true, false},
                                                      {nullptr, false, false, true},
                                                      {"retain", true, false, true},
                                                      {"constant", false, true, true}}};
  const auto belongs = [](const Member& member, const SectionKind& kind) {
    const ExportedVariable* const variable = member.variable;
    const bool constant = variable != nullptr && variable->constant;
    const bool retain = variable != nullptr && variable->retain && !constant;
    const bool located = variable != nullptr && !variable->address.empty();
    return constant == kind.constant && retain == kind.retain && located == kind.located;
  };
  Names names;
  for (const SectionKind& kind : kSectionKinds) {
    xml_node list;
    for (const Member& member : members) {
      if (!belongs(member, kind)) continue;
      if (!list) {
        list = parent.append_child(section);
        if (kind.attribute != nullptr) set(list, kind.attribute, "true");
      }
      add_variable(list, member, names, "");
    }
  }
}

class Writer {
 public:
  std::string write(const ExportedPlant& plant) {
    const xml_node declaration = document_.append_child(pugi::node_declaration);
    set(declaration, "version", "1.0");
    set(declaration, "encoding", "utf-8");
    xml_node project = document_.append_child("project");
    set(project, "xmlns", "http://www.plcopen.org/xml/tc6_0201");
    set(project, "xmlns:xhtml", "http://www.w3.org/1999/xhtml");
    add_headers(project, plant);
    declared_.begin(project.append_child("types"));
    const xml_node configurations = project.append_child("instances").append_child("configurations");
    Names names;
    for (const ExportedHost& host : plant.hosts) add_host(configurations, host, names.of(host.name));
    std::ostringstream stream;
    document_.save(stream, "  ", pugi::format_default, pugi::encoding_utf8);
    return stream.str();
  }

 private:
  static void add_headers(xml_node project, const ExportedPlant& plant) {
    const xml_node file = project.append_child("fileHeader");
    set(file, "companyName", "plchost");
    set(file, "productName", "plchost");
    set(file, "productVersion", plant.product_version);
    set(file, "creationDateTime", plant.time);
    xml_node content = add(project, "contentHeader", "plant");
    content.append_child("Comment").text() = kNotExported.data();
    xml_node coordinates = content.append_child("coordinateInfo");
    for (const char* const language : {"fbd", "ld", "sfc"}) {
      const xml_node scaling = coordinates.append_child(language).append_child("scaling");
      set(scaling, "x", "1");
      set(scaling, "y", "1");
    }
  }
  void add_host(xml_node parent, const ExportedHost& host, const std::string& name) {
    const xml_node configuration = add(parent, "configuration", name);
    Names names;
    for (const ExportedInstance& instance : host.instances)
      add_instance(configuration, instance, names.of(instance.name), host.instances.size() == 1);
    document(configuration, told_name(host.name, name));
  }

  // STruC++ knows no globals of a resource, so they stand in the configuration, if it has one resource only.
  void add_instance(xml_node parent, const ExportedInstance& instance, const std::string& name,
                    bool is_only) {
    const xml_node resource = add(parent, "resource", name);
    std::vector<Member> members = tree_of(instance.variables);
    std::map<std::string, std::string> types;  // of the programs, as they are written
    for (const ExportedProgram& program : instance.programs) {
      const auto found = std::ranges::find_if(members, [&](const Member& member) {
        return member.variable == nullptr && member.bounds.empty() &&
               folded(member.name) == folded(program.name);
      });
      types[program.name] =
          declared_.pou(program.type, found == members.end() ? std::vector<Member>() : found->members);
      if (found != members.end()) members.erase(found);
    }
    // Names of tasks, programs and globals may not be the same in ST.
    Names names;
    for (const Member& member : members) (void)names.of(member.name);
    edges_.clear();
    for (const ExportedTask& task : instance.tasks) add_task(resource, task, instance, types, names);
    const xml_node owner = is_only ? parent : resource;
    declared_.add_sections(owner, "globalVars", members);
    add_edges(owner);
    for (const ExportedProgram& program : instance.programs) {
      if (program.task.empty()) add_program(resource, program, types, names);
    }
    document(resource, told_name(instance.name, name));
  }

  void add_task(xml_node resource, const ExportedTask& task, const ExportedInstance& instance,
                const std::map<std::string, std::string>& types, Names& names) {
    using Kind = ExportedTask::Kind;
    const auto is_of_task = [&](const ExportedProgram& program) {
      return folded(program.task) == folded(task.name);
    };
    // In ST a program without a task freewheels.
    const bool stands_for_program =
        task.kind == Kind::freewheeling &&
        std::ranges::any_of(instance.programs, [&](const ExportedProgram& program) {
          return program.task.empty() && folded(program.name) == folded(task.name);
        });
    if (stands_for_program) return;
    const std::string name = names.of(task.name);
    const xml_node element = add(resource, "task", name);
    if (task.kind == Kind::cyclic) set(element, "interval", time_literal(task.interval_ns));
    if (task.kind == Kind::event)
      set(element, "single", task.event.empty() ? edge_of(name, names) : task.event);
    set(element, "priority", std::to_string(task.priority));
    for (const ExportedProgram& program : instance.programs) {
      if (!program.task.empty() && is_of_task(program)) add_program(element, program, types, names);
    }
    std::vector<std::string> words;
    if (task.kind == Kind::external) {
      add_external_event(element, task.event);
      words.push_back("the external event " + task.event + " runs it");
    }
    if (task.kind == Kind::freewheeling) words.emplace_back("it is freewheeling");
    if (task.kind == Kind::event && task.event.empty())
      words.emplace_back("it runs at each rising edge of a variable, whose name plchost does not know");
    if (std::string other = told_name(task.name, name); !other.empty()) words.push_back(std::move(other));
    document(element, fmt::format("{}", fmt::join(words, "; ")));
  }
  // The variable of an edge that is not known gets a name.
  std::string edge_of(const std::string& task, Names& names) {
    return edges_.emplace_back(names.of("edge_of_" + task));
  }
  void add_edges(xml_node resource) const {
    if (edges_.empty()) return;
    const xml_node list = resource.append_child("globalVars");
    for (const std::string& name : edges_) add_type(add(list, "variable", name).append_child("type"), "BOOL");
    document(list, "plchost does not know the true ones");
  }
  static void add_program(xml_node parent, const ExportedProgram& program,
                          const std::map<std::string, std::string>& types, Names& names) {
    const std::string name = names.of(program.name);
    const xml_node element = add(parent, "pouInstance", name);
    set(element, "typeName", types.at(program.name));
    document(element, told_name(program.name, name));
  }

  pugi::xml_document document_;
  Declared declared_;
  std::vector<std::string> edges_;  // of the tasks of a resource
};

}  // namespace

std::string project_of(const ExportedPlant& plant) {
  return Writer().write(plant);
}

}  // namespace plchost::plcopen
