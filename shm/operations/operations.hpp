#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "shm/base/time.hpp"

namespace plchost {

/// The operations of a host or of an instance. Up to 99 the value is the number of OPERATION_... in
/// api/control.idl; the others are between the manager and an instance only.
enum class ControlVerb : std::uint8_t {
#define OPERATION(verb, number, ...) verb = number,
#include "shm/operations/operations.def"
#undef OPERATION
};

/// The process that carries out an operation.
enum class OperationPlace : std::uint8_t {
  server,    ///< the API server, from shared memory
  host,      ///< the manager, for the whole host
  manager,   ///< the manager, for one instance
  instance,  ///< the process of the instance; the manager passes it on
  internal,  ///< the same, and only the manager asks for it
};

/// The role of a client is decided by the topic that it could write to. That of `viewing` is for all clients.
enum class ApiRole : std::uint8_t { viewing, operating, engineering };

/// A right that a key of [host] gives to a role. The topic's role alone does not suffice then.
enum class OperationRight : std::uint8_t { none, read_variables, write_variables };

/// The kind of the one argument that a row of the table of operations may have.
enum class OperationArgument : std::uint8_t {
  none,
  path,             ///< of an application, absolute, on the host
  file,             ///< name of an application's file, for people
  scheduler,        ///< name of a scheduler
  event,            ///< name of an external event of the instance
  task_or_none,     ///< name of a task; empty: all tasks
  variable_value,   ///< NAME=VALUE: a variable of the application, and a value as Structured Text writes it
  variable_or_all,  ///< name of a variable; "*": all
  debug_command,    ///< of instances/debugging.md
};

/// The options of a request beside its argument.
enum class OperationOptions : std::uint8_t { none, loading, download };

/// The time of an instance's process for an operation whose row has no other.
inline constexpr Duration kCommandLimit = std::chrono::seconds(10);
/// How long a client waits for an operation that takes longer. A stop may take 35 s, and a fresh process
/// comes after one. Longer than the server waits for the manager, so that its answer is heard.
inline constexpr Duration kLongCommand = std::chrono::seconds(80);

/// A row of the table of operations. Checks, roles, limits, words of plcctl with their help and completion,
/// and functions of the client library come from it.
struct Operation {
  ControlVerb verb{};
  std::string_view name;  ///< the verb's words: for people, in the audit log, and on control sockets
  OperationPlace place = OperationPlace::manager;
  ApiRole role = ApiRole::operating;
  OperationRight right = OperationRight::none;
  OperationArgument argument = OperationArgument::none;
  OperationOptions options = OperationOptions::none;
  bool names_instance = true;
  bool only_reads = false;  ///< changes nothing, so the audit log does not have it
  /// The time of an instance's process to carry it out, from when the manager hands it on.
  Duration limit = kCommandLimit;
  /// It waits for cycles or for a fresh process, beside the time of its limit.
  bool takes_long = false;
  /// "verb noun" of plcctl; empty: plcctl has words of its own for it, or none.
  const char* verb_word = "";
  const char* noun_word = "";
  const char* help = "";
  const char* verb_help = "";  ///< of the verb alone; empty: that of the noun
  /// Said of the instance when it was done; "{}": the argument.
  const char* done = "done";
};

[[nodiscard]] std::span<const Operation> operations() noexcept;
/// All verbs have one.
[[nodiscard]] const Operation& operation_of(ControlVerb verb) noexcept;
/// The least time that a client waits for the reply, unless its user says how long. Zero: as for any request.
[[nodiscard]] Duration least_wait(const Operation& operation) noexcept;
/// Of a number of control.idl, or of a name. Null: there is none, or only the manager asks for it.
[[nodiscard]] const Operation* find_operation(std::int32_t number) noexcept;
[[nodiscard]] const Operation* find_operation(std::string_view name) noexcept;
[[nodiscard]] std::string_view to_string(ControlVerb verb) noexcept;

/// Said of forces of variables that ended with a process or a version: "2 forces ended"; empty: none.
[[nodiscard]] std::string ended_forces_text(std::size_t count);

/// Said when it was done with that argument.
[[nodiscard]] std::string done_text(const Operation& operation, std::string_view argument);

}  // namespace plchost
