#include "instances/adapters/translator.hpp"

#include <string_view>

#include "instances/adapters/iec/environment.hpp"
#include "instances/adapters/matiec/iec2c.hpp"
#include "instances/adapters/strucpp/compiler.hpp"

namespace plchost {

std::unique_ptr<Translator> choose_translator(BuildContext& context) {
  const BuildOrder& order = context.order;
  // An option counts more than a variable of the environment.
  const bool by_option = !order.matiec.empty() || !order.strucpp.empty();
  const auto is_named = [&](const std::string& folder, const char* variable) {
    return by_option ? !folder.empty() : !iec::environment(variable).empty();
  };
  const bool names_matiec = is_named(order.matiec, "PLCHOST_MATIEC");
  const bool names_strucpp = is_named(order.strucpp, "PLCHOST_STRUCPP");
  const auto is_chosen = [&](std::string_view compiler, bool is_only_one) {
    return order.compiler.empty() ? is_only_one : order.compiler == compiler;
  };
  if (is_chosen("matiec", names_matiec && !names_strucpp)) return make_matiec_translator(context);
  if (is_chosen("strucpp", names_strucpp && !names_matiec)) return make_strucpp_translator(context);
  const auto matiec = matiec::find_compiler(order.matiec);
  const auto strucpp = strucpp::find_compiler(order.strucpp);
  // A folder that is named, and is none of a compiler, is an error also if the other one is found.
  if (names_matiec && !context.has(matiec)) return nullptr;
  if (names_strucpp && !context.has(strucpp)) return nullptr;
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
