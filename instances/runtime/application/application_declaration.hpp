#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "instances/plc_app.h"
#include "instances/runtime/debug/declared_pou.hpp"
#include "instances/runtime/memory/declared_area.hpp"
#include "instances/runtime/settings/settings.hpp"
#include "instances/runtime/variables/declared_variable.hpp"

namespace plchost {

/// Variables that plc_keep_variables() names.
struct CarriedVariables {
  void* address = nullptr;  ///< in the application; null: only their layout is compared
  std::uint32_t bytes = 0;
  std::uint64_t layout = 0;
};

using CarriedByName = std::map<std::string, CarriedVariables, std::less<>>;

struct EventCallback {
  unsigned event = 0;
  PF_EVENT_CALLBACK function = nullptr;
  void* user = nullptr;
  bool operator==(const EventCallback&) const = default;
};

/// An application's declaration of itself in its plc_app_init. It is collected here, checked as a whole, and
/// then committed: at the first load as in an online change. Nothing of it holds before.
/// Channels are no part of it: plc_channel_open() makes the instance a node at once, as its result and
/// plc_node_address() tell plc_app_init. A refused version leaves that node, which tasks may use.
struct ApplicationDeclaration {
  sys_setup_tasks_struct* tasks = nullptr;  ///< in the application; null: nothing yet
  bool tasks_given_twice = false;
  std::vector<TaskSettings> task_options;
  std::string scheduler;  ///< that it is made for; empty: it names none
  CarriedByName variables;
  std::uint64_t variable_bytes = 0;  ///< of all of them
  std::vector<RTS_HANDLE> events;    ///< own ones that it registers
  std::vector<EventCallback> callbacks;
  std::vector<DeclaredArea> areas;  ///< at the first load Areas gets them
  VariableCollection seen;          ///< variables that are seen from outside; VariableService gets them
  PouCollection pous;               ///< of a debug build
};

}  // namespace plchost
