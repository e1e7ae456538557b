#include "instances/adapters/translator.hpp"

#include <string_view>

#include "instances/adapters/iec/environment.hpp"
#include "instances/adapters/matiec/iec2c.hpp"
#include "instances/adapters/strucpp/compiler.hpp"

namespace plchost {

std::unique_ptr<Translator> choose_translator(BuildContext& context) {
  const BuildOrder& order = context.order;
  const auto named = [&](std::string_view compiler, const std::string& folder, const std::string& other) {
    return order.compiler.empty() ? !folder.empty() && other.empty() : order.compiler == compiler;
  };
  if (named("matiec", order.matiec, order.strucpp)) return make_matiec_translator(context);
  if (named("strucpp", order.strucpp, order.matiec)) return make_strucpp_translator(context);
  const auto matiec = matiec::find_compiler(order.matiec);
  const auto strucpp = strucpp::find_compiler(order.strucpp);
  // A folder that is named, and is none of a compiler, is an error also if the other one is found.
  const auto is_named = [](const std::string& folder, const char* variable) {
    return !folder.empty() || !iec::environment(variable).empty();
  };
  if (is_named(order.matiec, "PLCHOST_MATIEC") && !context.has(matiec)) return nullptr;
  if (is_named(order.strucpp, "PLCHOST_STRUCPP") && !context.has(strucpp)) return nullptr;
  if (matiec && strucpp) {
    context.report.remarks.push_back(
        {{}, "MATIEC and STruC++ are both there, and MATIEC is used; choose one by --compiler"});
  }
  if (matiec) return make_matiec_translator(context);
  if (strucpp) return make_strucpp_translator(context);
  context.fail("there is no compiler for Structured Text. " + matiec.error().describe() + ". " +
               strucpp.error().describe());
  return nullptr;
}

}  // namespace plchost
