#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/cli/debug/debug_link.hpp"
#include "api/cli/debug/debug_state.hpp"
#include "api/cli/debug/expanded_array.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// One client of the Debug Adapter Protocol. Tasks are threads. The instance is attached to with the request
/// "attach"; its breakpoints go and its tasks go on with "disconnect", or when this object ends.
class DapSession {
 public:
  /// `send` gets each message; both outlive this.
  DapSession(DebugLink& link, std::function<void(const nlohmann::json&)> send, bool take)
      : link_(link), send_(std::move(send)), take_(take) {}
  ~DapSession();
  DapSession(const DapSession&) = delete;
  DapSession& operator=(const DapSession&) = delete;

  /// Answers a request. False: the client has left.
  [[nodiscard]] bool obey(const nlohmann::json& request);
  /// Tells the client of halts and of lines of log points. An error: the session with the instance is over.
  [[nodiscard]] Result<void> look();

 private:
  using Json = nlohmann::json;
  using Answer = Result<Json>;  ///< the body
  /// A frame's number: the thread's, and the place in its stack. Those of its global and local variables are
  /// larger, and those of arrays larger than all of them.
  static constexpr std::int64_t kFramesOfThread = 1000;
  static constexpr std::int64_t kFrames = 250;
  static constexpr std::int64_t kGlobals = kFrames;
  static constexpr std::int64_t kLocals = 2 * kFrames;
  static constexpr std::int64_t kArrays = 1'000'000'000;  // the protocol's limit is 2^31
  [[nodiscard]] static bool is_of_globals(std::int64_t reference) noexcept {
    return reference % kFramesOfThread / kFrames * kFrames == kGlobals;
  }
  [[nodiscard]] static bool is_of_locals(std::int64_t reference) noexcept {
    return reference % kFramesOfThread / kFrames * kFrames == kLocals;
  }
  /// The number of the local variables of a frame; of one that has this number already the same.
  [[nodiscard]] static std::int64_t locals_of(std::int64_t frame) noexcept {
    return frame / kFramesOfThread * kFramesOfThread + kLocals + frame % kFramesOfThread % kFrames;
  }

  [[nodiscard]] Answer carry_out(const std::string& command, const Json& arguments);
  [[nodiscard]] Answer attach(const Json& arguments);
  [[nodiscard]] Answer set_breakpoints(const Json& arguments);
  [[nodiscard]] Answer set_function_breakpoints(const Json& arguments);
  [[nodiscard]] Json set_one(const std::string& key, const Result<std::string>& place, const Json& wanted);
  /// An error: some of them stay.
  [[nodiscard]] Result<void> remove_of(const std::string& key);
  [[nodiscard]] Answer threads();
  [[nodiscard]] Answer stack(const Json& arguments);
  [[nodiscard]] Answer scopes(const Json& arguments);
  [[nodiscard]] Answer variables(const Json& arguments);
  [[nodiscard]] Answer set_variable(const Json& arguments);
  [[nodiscard]] Answer evaluate(const Json& arguments);
  [[nodiscard]] Answer go_on(const std::string& command, const Json& arguments);
  /// Those that halt, but for this task. wrong_state: it does not halt itself; no task is let go.
  [[nodiscard]] Result<void> let_others_go(const std::string& task);
  [[nodiscard]] Answer pause(const Json& arguments);
  [[nodiscard]] Answer elements_of(std::int64_t reference, const Json& arguments);
  /// An array that the client was shown.
  struct ShownArray {
    ExpandedArray array;
    std::int64_t locals = 0;  ///< the number of the local variables that it is of; 0: it is none
    bool operator==(const ShownArray&) const = default;
  };
  /// Null: it is of no array.
  [[nodiscard]] const ShownArray* array_at(std::int64_t reference) const noexcept;
  /// Gives an array a number that its client expands it by.
  void make_expandable(Json& told, std::string_view type, std::int64_t locals);
  [[nodiscard]] Json local_json(const Json& local, std::int64_t locals);
  /// Elements `first` to `end` - 1.
  [[nodiscard]] Answer declared_elements(const ExpandedArray& array, std::uint64_t first, std::uint64_t end);
  [[nodiscard]] Answer local_elements(const ShownArray& shown, std::uint64_t first, std::uint64_t end) const;
  /// Without `prefix` in its name. An array gets a number to be expanded by.
  [[nodiscard]] Json variable_json(const plc_VariableRecord& variable, std::string_view prefix);
  /// The value that a name means in a frame.
  [[nodiscard]] Answer evaluated(std::int64_t number, const std::string& name, const std::string& context);
  /// Writes what the name means in a frame.
  [[nodiscard]] Answer written(std::int64_t frame, const std::string& name, const std::string& value);
  [[nodiscard]] Answer written_variable(const std::string& instance, const std::string& name,
                                        const std::string& value);
  [[nodiscard]] Answer written_local(std::int64_t frame, const std::string& name, const std::string& value);
  [[nodiscard]] Result<std::string> task_of(const Json& arguments);
  [[nodiscard]] std::int64_t thread_of(const std::string& task) const;
  /// The path that the client has for a file of the instance; the file itself: none is known.
  [[nodiscard]] std::string path_of(const std::string& file) const;
  /// Also by the number of its local variables; an empty object: there is none.
  [[nodiscard]] Json frame_at(std::int64_t number) const;
  void event(const std::string& name, Json body);
  void tell(const std::string& category, const std::string& text);
  void tell_halt(const Json& task);
  void tell_those_that_go_on();
  /// Tells of the changes that another version of the application or another scheduler has made.
  void tell_changes();

  DebugLink& link_;
  std::function<void(const Json&)> send_;
  bool take_;
  bool halts_all_ = false;  // a breakpoint halts all tasks
  std::int64_t sequence_ = 1;
  Json state_;
  std::vector<std::string> tasks_;  // thread 1 is the first
  DebugNews news_;
  std::vector<ShownArray> arrays_;
  std::map<std::string, std::size_t> array_numbers_;
  std::set<std::string> halted_;                           // as the client was told
  std::set<std::string> sources_;                          // paths of the client
  std::map<std::string, std::string> paths_;               // of those, by the file of their breakpoints
  std::map<std::string, std::vector<std::uint32_t>> ids_;  // breakpoints by source, or "" of functions
};

}  // namespace plchost
