#include "instances/adapters/c_compiler.hpp"

#include <filesystem>
#include <utility>

#include <fmt/format.h>
#include <wordexp.h>

namespace plchost {

Result<std::vector<std::string>> c_compiler_words(const char* command, const char* variable,
                                                  const char* usual) {
  std::vector<std::string> words;
  if (command != nullptr) {
    wordexp_t expanded{};
    const int error = ::wordexp(command, &expanded, WRDE_NOCMD);
    if (error != 0) {
      return failure(ErrorCode::invalid_argument,
                     fmt::format("{}='{}' is no command of a compiler; allowed are words and quotes",
                                 variable, command));
    }
    words.assign(expanded.we_wordv, expanded.we_wordv + expanded.we_wordc);
    ::wordfree(&expanded);
  }
  if (words.empty()) return std::vector<std::string>{usual};
  std::error_code error;
  if (words.front().contains('/')) words.front() = std::filesystem::absolute(words.front(), error);
  return words;
}

std::vector<std::string> c_compiler_arguments(const CompileOrder& order) {
  using Kind = CompileOrder::Kind;
  std::vector<std::string> arguments;
  if (order.kind == Kind::cpp_application) {
    arguments = {"-std=c++17", "-DSTRUCPP_THREADED"};
  } else {
    arguments = {"-std=gnu11", "-D__CURRENT_TIME=(*plchost_now())"};
  }
  // Integers wrap, and values are seen through pointers of other types: the compilers rely on both. All
  // symbols are the application's own, so that two versions can be loaded at a time.
  arguments.insert(arguments.end(),
                   {"-O2", "-g1", "-w", "-fwrapv", "-fno-strict-aliasing", "-fPIC", "-fvisibility=hidden"});
  arguments.insert(arguments.end(), order.flags.begin(), order.flags.end());
  // The folder of the sources is none of them: a header in it may have the name of a header of the system.
  for (const std::string& folder : order.folders) arguments.push_back("-I" + folder);
  if (order.kind == Kind::c_objects) {
    arguments.emplace_back("-c");
  } else {
    arguments.insert(arguments.end(), {"-shared", "-o", order.output});
  }
  arguments.insert(arguments.end(), order.sources.begin(), order.sources.end());
  if (order.kind != Kind::c_objects) arguments.emplace_back("-lm");
  return arguments;
}

}  // namespace plchost
