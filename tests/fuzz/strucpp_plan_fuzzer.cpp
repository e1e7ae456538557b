#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>

#include "instances/adapters/iec/debug_pous.hpp"
#include "instances/adapters/iec/glue.hpp"
#include "instances/adapters/strucpp/glue.hpp"
#include "instances/adapters/strucpp/plan_file.hpp"

namespace {

using namespace plchost;

constexpr std::string_view kPlan =
    R"({"format":1,"problems":[],"remarks":[],"files":["configuration.cpp"],"pous":[{"kind":"program",)"
    R"("name":"MAIN","place":[0,1,1],"variables":[{"name":"RAW","type":"INT","location":"%IW1",)"
    R"("section":"local","retain":true,"constant":false,"place":[0,4,7],"member":"RAW"}]}],"types":[{"name":"T",)"
    R"("definition":"T : ARRAY[1..2] OF INT","place":[0,2,1]}],"symbols":[{"name":"ONE.GRID[][].X",)"
    R"("type":"INT","value":"g_config.ONE.GRID[][].X","bounds":[[0,1],[-2,3]]}],"hidden":[{"name":"ONE.CAL","why":"x"}],"configurations":[{"name":"cell","place":[0,8,1],)"
    R"("globals":[{"name":"GO","type":"BOOL","location":"%IX0.0","section":"global","retain":false,)"
    R"("constant":false,"place":[0,9,1],"member":"GO.value"}],"resources":[{"name":"press","place":[0,8,1],)"
    R"("tasks":[{"name":"fast","interval":"T#2MS","single":"","priority":"1","place":[0,9,5]}],)"
    R"("programs":[{"name":"one","type":"MAIN","task":"FAST","place":[0,11,5]}]}]}]})";

/// Bytes alone seldom make a plan.
constexpr std::array<std::string_view, 24> kTexts{"0",        "-1",     "1e99",     "18446744073709551615",
                                                  "true",     "null",   "[",        "]",
                                                  "{",        "}",      "\"",       "\"\"",
                                                  ":",        ",",      "external", "output",
                                                  "function", "%QX0.1", "%MD4",     "ARRAY[1..9] OF T",
                                                  "T#1H",     "STRING", "GO",       "MAIN"};

/// The plan, with these texts: for each a place, the number of bytes that it replaces, and itself.
std::string changed_plan(const std::uint8_t* data, std::size_t size) {
  std::string text(kPlan);
  for (std::span<const std::uint8_t> rest(data, size); rest.size() >= 4; rest = rest.subspan(4)) {
    const std::size_t at = (std::size_t{rest[0]} * 256 + rest[1]) % text.size();
    text.replace(at, rest[2] % 32, kTexts.at(rest[3] % kTexts.size()));
  }
  return text;
}

void read(std::string_view text) {
  const std::array<std::string, 1> sources{"a.st"};
  const auto plan = strucpp::read_plan(text, sources);
  if (!plan) {
    if (plan.error().message.empty() || plan.error().message.size() > 2'000) std::abort();
    return;
  }
  const std::array<iec::DebugPou, 1> pous{{{.name = "MAIN", .file = "a.st", .lines = {1}}}};
  for (const iec::Configuration& configuration : plan->project.configurations) {
    for (const iec::Resource& resource : configuration.resources)
      (void)strucpp::write_glue(plan->project, configuration, resource, plan->files, plan->symbols, pous);
  }
}

}  // namespace

// Any text is a plan, or an error says in a few words why it is none.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  read({reinterpret_cast<const char*>(data), size});
  read(changed_plan(data, size));
  return 0;
}
