#include "api/cli/debug/debug_link.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <string_view>

#include <fmt/format.h>

#include "api/cli/debug/debug_state.hpp"
#include "api/cli/debug/foreign_json.hpp"
#include "api/cli/rows/variable_rows.hpp"
#include "api/dds/text.hpp"
#include "api/dds/variable_page.hpp"
#include "shm/base/names.hpp"
#include "shm/variables/variable_symbol.hpp"

namespace plchost {

namespace {

constexpr int kAttempts = 5;
// A host that says that its state is longer is not believed.
constexpr std::size_t kLongestState = std::size_t{1} << 20;
// The instance ends a session of which it has had no sign for 10 s. Each request for the state is one.
constexpr auto kSign = std::chrono::seconds(1);
// A write waits for a moment between cycles.
constexpr auto kWritePatience = std::chrono::seconds(10);

std::unexpected<Error> bad_answer(std::string_view text) {
  return failure(ErrorCode::corrupt, fmt::format("the host's answer is not understood: '{}'", shown(text)));
}

Result<nlohmann::json> parsed(std::string_view text) {
  auto json = object_in(text);
  if (!json) return bad_answer(text);
  return *std::move(json);
}

// Whole arrays are shown as "Line.temperature[]", and asked for without the brackets.
std::string asked_name(std::string name) {
  constexpr std::string_view kBrackets = "[]";
  for (std::size_t at = name.find(kBrackets); at != std::string::npos; at = name.find(kBrackets))
    name.erase(at, kBrackets.size());
  return name;
}

}  // namespace

DebugRequests debug_requests(CliSession& session, const std::string& host, const std::string& instance) {
  return {
      .call = [&session, host, instance](ControlVerb verb,
                                         const std::string& argument) -> Result<std::string> {
        PLCHOST_TRY_ASSIGN(auto* const client, session.client());
        const ApiRequest request{.host = host,
                                 .operation = static_cast<std::int32_t>(verb),
                                 .instance = instance,
                                 .argument = argument};
        PLCHOST_TRY_ASSIGN(auto reply, client->call(request, session.deadline(kWritePatience)));
        if (reply.code != ErrorCode::ok) return failure(reply.code, reply.text);
        return std::move(reply.text);
      },
      .list_variables = [&session, host, instance](const VariableQuery& query) -> Result<VariableListing> {
        PLCHOST_TRY_ASSIGN(auto* const client, session.client());
        return client->list_variables(host, instance, query, session.deadline());
      },
      .read_state = [&session, host, instance](const DebugQuery& query) -> Result<DebugPart> {
        PLCHOST_TRY_ASSIGN(auto* const client, session.client());
        return client->read_debug(host, instance, query, session.deadline());
      },
      .now = MonotonicClock::now};
}

Result<std::string> DebugLink::attach(bool take) {
  PLCHOST_TRY_ASSIGN(const auto text, requests_.call(ControlVerb::debug, take ? "attach take" : "attach"));
  PLCHOST_TRY_ASSIGN(const auto answer, parsed(text));
  number_ = answer.value("session", std::uint64_t{0});
  if (number_ == 0) return bad_answer(text);
  return answer.value("remark", std::string());
}

Result<void> DebugLink::detach() {
  if (number_ == 0) return {};
  const auto done = command("detach");
  number_ = 0;
  if (!done) return std::unexpected(done.error());
  return {};
}

Result<nlohmann::json> DebugLink::command(const std::string& text) {
  PLCHOST_TRY_ASSIGN(const auto answer,
                     requests_.call(ControlVerb::debug, fmt::format("{} {}", number_, text)));
  return parsed(answer);
}

Result<void> DebugLink::stay() {
  if (number_ != 0 && now() - seen_ >= kSign) PLCHOST_TRY(part(0));
  return {};
}

Result<DebugPart> DebugLink::part(std::size_t offset) {
  auto part = requests_.read_state({.session = number_, .offset = offset});
  if (!part && part.error().code == ErrorCode::not_found && number_ != 0) {
    return failure(
        ErrorCode::wrong_state,
        "the debug session is over: the process of the instance has ended, or has another application");
  }
  seen_ = now();
  return part;
}

// The contract lets a host tell its state in several pages.
Result<std::optional<std::string>> DebugLink::whole_state() {
  PLCHOST_TRY_ASSIGN(const auto first, part(0));
  std::string text;
  for (DebugPart next = first;;) {
    if (next.version != first.version) return std::nullopt;
    const bool fits = next.size == first.size && next.offset == text.size() && next.size <= kLongestState &&
                      next.text.size() <= next.size - next.offset;
    if (!fits || next.text.empty()) return bad_answer(next.text);
    text += next.text;
    if (text.size() == first.size) return text;
    PLCHOST_TRY_ASSIGN(next, part(text.size()));
  }
}

Result<nlohmann::json> DebugLink::state() {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    PLCHOST_TRY_ASSIGN(const auto text, whole_state());
    if (!text) continue;
    PLCHOST_TRY_ASSIGN(auto state, parsed(*text));
    if (state.value("too_long", false))
      return failure(ErrorCode::full, "the state of the debugger is too long to be told; delete breakpoints");
    if (number_ == 0 || state.value("session", std::uint64_t{0}) == number_) return state;
    return failure(ErrorCode::wrong_state,
                   "the debug session is over: the instance has ended it, or another "
                   "debugger took over");
  }
  return failure(ErrorCode::busy, "the state of the debugger changes all the time; ask again");
}

Result<std::vector<ListedVariable>> DebugLink::listed(VariableQuery query) {
  std::vector<ListedVariable> all;
  for (bool goes_on = true; goes_on;) {
    PLCHOST_TRY(stay());
    PLCHOST_TRY_ASSIGN(auto page, requests_.list_variables(query));
    PLCHOST_TRY_ASSIGN(goes_on, next_page(host_, page, query));
    std::ranges::move(page.variables, std::back_inserter(all));
  }
  return all;
}

Result<std::vector<ListedVariable>> DebugLink::globals() {
  PLCHOST_TRY_ASSIGN(auto found, if_found(listed({})));
  if (!found) return std::vector<ListedVariable>();
  std::vector<ListedVariable> programs;
  std::ranges::copy_if(*found, std::back_inserter(programs), is_program);
  const auto is_no_global = [&](const plc_VariableRecord& variable) {
    const std::string_view name = dds::text_of(variable.name);
    const std::size_t dot = name.find('.');
    if (is_program(variable)) return true;
    if (dot == std::string_view::npos || programs.empty()) return dot != std::string_view::npos;
    return std::ranges::any_of(programs, [&](const plc_VariableRecord& program) {
      return same_variable_name(dds::text_of(program.name), name.substr(0, dot));
    });
  };
  std::erase_if(*found, is_no_global);
  return *std::move(found);
}

Result<ListedVariable> DebugLink::variable(const std::string& instance, const std::string& shown_name) {
  const std::string name = asked_name(shown_name);
  if (!instance.empty()) {
    auto own = variables(fmt::format("{}.{}", instance, name));
    if (own && own->size() == 1) return own->front();
    // Such as an index out of the range of an own array.
    if (!own && own.error().code != ErrorCode::not_found) return std::unexpected(own.error());
  }
  PLCHOST_TRY_ASSIGN(const auto found, if_found(variables(name)));
  if (found && found->size() == 1) return found->front();
  std::vector<std::string> wholes{name};
  if (!instance.empty()) wholes.insert(wholes.begin(), fmt::format("{}.{}", instance, name));
  for (const std::string& whole : wholes) {
    const auto members = variables(whole + ".*");
    if (members && !members->empty())
      return std::unexpected(has_members(name, dds::text_of(members->front().name)));
  }
  return failure(ErrorCode::not_found, fmt::format("no variable '{}' in '{}'", shown(name),
                                                   instance.empty() ? instance_ : instance));
}

Result<std::string> DebugLink::write(const std::string& instance, const std::string& name,
                                     const std::string& value) {
  PLCHOST_TRY_ASSIGN(const auto found, variable(instance, name));
  std::string whole(dds::text_of(found.name));
  PLCHOST_TRY(requests_.call(ControlVerb::write_variable, fmt::format("{}={}", whole, value)));
  return whole;
}

Result<void> DebugLink::write_local(const std::string& task, std::int64_t frame, const std::string& name,
                                    const std::string& value) {
  PLCHOST_TRY(command(fmt::format("local {} {} {}={}", task, frame, name, value)));
  return {};
}

}  // namespace plchost
