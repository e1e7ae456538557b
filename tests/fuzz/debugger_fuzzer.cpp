#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "api/cli/debug/dap_messages.hpp"
#include "api/cli/debug/foreign_json.hpp"
#include "instances/runtime/debug/breakpoint.hpp"
#include "instances/runtime/debug/condition.hpp"
#include "instances/runtime/debug/declared_pou.hpp"

namespace {

using namespace plchost;

// One variable of each type, called by the number of its type.
Result<ValuePlace> find_value(std::string_view name) {
  static const std::array<std::byte, 512> bytes{};
  const auto types = variable_types();
  for (std::size_t i = 0; i < types.size(); ++i) {
    if (name != "v" + std::to_string(i)) continue;
    const std::uint32_t size = types[i].bytes != 0 ? types[i].bytes : 16U;
    constexpr std::array kBases = {ValuePlace::Base::address, ValuePlace::Base::self,
                                   ValuePlace::Base::local};
    return ValuePlace{.type = types[i].type,
                      .bytes = size,
                      .base = kBases.at(i % kBases.size()),
                      .address = bytes.data(),
                      .local = static_cast<std::uint32_t>(i)};
  }
  return failure(ErrorCode::not_found, "no such variable");
}

void read_messages(std::string_view text) {
  DapReader reader;
  for (std::size_t at = 0; at < text.size(); at += 7) {
    reader.add(text.substr(at, 7));
    for (;;) {
      const auto message = reader.next();
      if (!message) return;
      if (!*message) break;
      if (dap_packet(**message).empty()) std::abort();
      if (text_in(**message, "command").empty()) (void)number_in(**message, "seq");
    }
  }
}

// An accepted text can be evaluated, in a frame with variables and in one without.
void evaluate(const Condition& condition) {
  std::array<std::byte, 512> self{};
  const std::array<void*, 2> locals{self.data(), nullptr};
  Plc_Frame frame{};
  (void)condition.holds(frame);
  frame.pSelf = self.data();
  frame.ppLocals = locals.data();
  frame.dwFirstLocal = 2;
  frame.nLocals = locals.size();
  (void)condition.holds(frame);
}

void read_parts(std::string_view hits, std::string_view log, std::string_view condition) {
  if (const auto rule = HitRule::parse(hits)) {
    for (const std::uint64_t hit : {1U, 2U}) (void)rule->holds(hit);
  }
  (void)LogTemplate::parse(log, find_value);
  if (const auto read = Condition::parse(condition, find_value)) evaluate(*read);
}

void make_breakpoint(std::string_view text) {
  const auto order = BreakpointOrder::parse(text);
  if (order && !order->place.empty()) read_parts(order->hits, order->log, order->condition);
}

void find_place(std::string_view text) {
  static constexpr std::array kLines = {3U, 7U, 4'000'000'000U};
  static Plc_Pou pou = {sizeof(Plc_Pou), "Main", "src/main.st", kLines.data(), kLines.size(), 0, nullptr, 0,
                        nullptr,         0};
  static const PouCollection pous = [] {
    PouCollection made;
    if (made.declare(&pou) != ERR_OK) std::abort();
    return made;
  }();
  const auto found = pous.find(text);
  if (found && (found->pou != 0 || !pous.pous().front().line_from(found->line))) std::abort();
}

}  // namespace

// Messages of a client of the Debug Adapter Protocol, commands of a debugger, and places.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  read_messages(text);
  make_breakpoint(text);
  read_parts(text, text, text);
  find_place(text);
  return 0;
}
