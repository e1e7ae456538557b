#include "instances/adapters/build_context.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <sstream>

#include <fmt/format.h>

namespace plchost {

namespace {

constexpr std::ptrdiff_t kShownLines = 20;  // of a compiler's output

}  // namespace

std::string first_lines(const std::string& text) {
  std::istringstream stream(text);
  std::string result;
  std::string line;
  for (std::ptrdiff_t i = 0; i < kShownLines && std::getline(stream, line); ++i) result += "\n  " + line;
  return result;
}

void BuildContext::refuse_persistent(const iec::Project& read, const char* compiler) {
  for (const iec::SourcePlace& place : read.persistent) {
    fail({place,
          fmt::format("PERSISTENT: {} does not know this word; write RETAIN, whose values are kept over "
                      "restarts and power cuts, until a cold reset",
                      compiler)});
  }
}

bool BuildContext::open_folder() {
  auto folder = order.keep.empty() ? WorkFolder::make_temporary() : WorkFolder::make_kept(order.keep);
  if (!has(folder)) return false;
  folder_.emplace(*std::move(folder));
  return true;
}

bool BuildContext::rewrite(std::span<const std::string> files,
                           const std::function<std::string(const std::string&)>& change) {
  return std::ranges::all_of(files, [&](const std::string& file) {
    const auto text = folder().read(file);
    return has(text) && has(folder().replace(file, change(*text)));
  });
}

std::optional<ProgramEnd> BuildContext::run(const char* what, const std::vector<std::string>& command,
                                            Duration limit) {
  auto end = run_program(command, folder().path(), {.time = limit, .cancelled = order.cancelled});
  if (!end) {
    fail(fmt::format("{} cannot be started: {}", what, end.error().describe()));
  } else if (end->cancelled) {
    fail("interrupted: nothing was built");
  } else if (end->over_limit) {
    fail(
        fmt::format("{} has run for {} s and was ended; try again when the machine is not busy, or make the "
                    "program smaller",
                    what, std::chrono::duration_cast<std::chrono::seconds>(limit).count()));
  } else {
    return *std::move(end);
  }
  return std::nullopt;
}

bool BuildContext::compile(const char* what, std::vector<std::string> words,
                           const CompileOrder& compile_order, const FindSource& find_source) {
  std::ranges::move(c_compiler_arguments(compile_order), std::back_inserter(words));
  const auto end = run(what, words, order.compile_limit);
  if (!end || end->success()) return end.has_value();
  for (const iec::SourceProblem& problem : problems_of_compiler(end->output, find_source))
    fail({problem.place, fmt::format("{}: {}", what, problem.text)});
  const std::string said = first_lines(std::string(from_first_error(end->output)));
  if (good() && end->signal != 0) {
    fail(fmt::format("{} was ended by SIG{}{}{}", what, ::sigabbrev_np(end->signal), said.empty() ? "" : ":",
                     said));
  } else if (good() && said.empty()) {
    fail(fmt::format("{} has ended with exit code {}, and has not said why", what, end->exit_code));
  } else if (good()) {
    fail(fmt::format("{} refuses what was written for it:{}", what, said));
  }
  return false;
}

std::optional<std::vector<std::string>> BuildContext::words_of(const char* variable, const char* usual) {
  const char* const value = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe): one thread here
  auto words = c_compiler_words(value, variable, usual);
  if (!has(words)) return std::nullopt;
  return *std::move(words);
}

std::vector<std::string> BuildContext::application_files() const {
  const std::string folder = adapters() + "/application/";
  return {folder + "application.c", folder + "copies.c", folder + "places.c", folder + "symbols.c",
          folder + "variables.c"};
}

}  // namespace plchost
