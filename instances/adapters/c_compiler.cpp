#include "instances/adapters/c_compiler.hpp"

#include <filesystem>
#include <utility>

#include <fmt/format.h>
#include <wordexp.h>

namespace plchost {

Result<std::vector<std::string>> c_compiler_words(const char* cc) {
  std::vector<std::string> words;
  if (cc != nullptr) {
    wordexp_t expanded{};
    const int error = ::wordexp(cc, &expanded, WRDE_NOCMD);
    if (error != 0) {
      return failure(ErrorCode::invalid_argument,
                     fmt::format("CC='{}' is no command of a compiler; allowed are words and quotes", cc));
    }
    words.assign(expanded.we_wordv, expanded.we_wordv + expanded.we_wordc);
    ::wordfree(&expanded);
  }
  if (words.empty()) return std::vector<std::string>{"cc"};
  std::error_code error;
  if (words.front().contains('/')) words.front() = std::filesystem::absolute(words.front(), error);
  return words;
}

std::vector<std::string> c_compiler_arguments(const CompileOrder& order) {
  // Integers wrap, and values are seen through pointers of other types: MATIEC relies on both. All symbols
  // are the application's own, so that two versions can be loaded at a time.
  std::vector<std::string> arguments{"-std=gnu11",
                                     "-O2",
                                     "-g1",
                                     "-w",
                                     "-fwrapv",
                                     "-fno-strict-aliasing",
                                     "-fPIC",
                                     "-shared",
                                     "-fvisibility=hidden",
                                     "-D__CURRENT_TIME=(*plchost_now())"};
  // The folder of the sources is none of them: a header in it may have the name of a header of the system.
  for (const std::string& folder : order.folders) arguments.push_back("-I" + folder);
  arguments.insert(arguments.end(), {"-o", order.output});
  arguments.insert(arguments.end(), order.sources.begin(), order.sources.end());
  arguments.emplace_back("-lm");
  return arguments;
}

}  // namespace plchost
