#include <filesystem>
#include <iterator>
#include <memory>
#include <ranges>
#include <string>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/interrupt.hpp"
#include "api/cli/own_folder.hpp"
#include "instances/adapters/build_application.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

// A compiler's output has several lines.
void tell(const std::string& text) {
  for (const auto line : std::views::split(text, '\n')) {
    fmt::print(stderr, "{}\n", printable(std::string(line.begin(), line.end())));
  }
}

int build(const CliSession& session, BuildOrder order) {
  order.adapters = own_folder().parent_path() / "share" / "plchost" / "adapters";
  order.check_program = own_folder() / "plc-instance";
  order.cancelled = interrupted;
  catch_interrupts();
  const BuildReport report = build_application(order);
  for (const auto& problem : report.problems) tell(iec::describe(problem));
  if (!report.problems.empty()) return kExitFailed;
  for (const auto& remark : report.remarks) tell(iec::describe({remark.place, "note: " + remark.text}));
  if (session.options.quiet) return kExitDone;
  for (const std::string& application : report.applications)
    fmt::print("{}: built\n", printable(application));
  return kExitDone;
}

}  // namespace

void add_build_verb(const Command& plcctl, CliSession& session) {
  const auto order = std::make_shared<BuildOrder>();
  plcctl.verb("build", "Translate a program into an application, on this machine")
      .noun("application",
            "Translate Structured Text, or PLCopen XML with bodies in it, with MATIEC or STruC++. Each TASK "
            "becomes a task, located variables lie in the areas inputs, outputs and memory",
            [&session, order] { return build(session, *order); })
      .arguments("SOURCE", order->sources,
                 "files (*.xml: PLCopen XML), or folders, of which the *.st at any depth are meant; one "
                 "CONFIGURATION "
                 "in all of them")
      .file("-o,--application", order->output,
            "where the application goes; of several resources each has its name in it")
      .option(
          "--tasks", order->tasks,
          "external events, watchdogs and other options of the tasks, as TOML (else X.toml beside a single "
          "X.st, X.xml or folder X, or tasks.toml in that folder)",
          "")
      .word("--compiler", order->compiler,
            "matiec or strucpp (else the one of which the folder is named, or that is found, first MATIEC)",
            {std::begin(kCompilers), std::end(kCompilers)})
      .option("--matiec", order->matiec,
              "folder of the compiler iec2c with its lib (else by PLCHOST_MATIEC, else in PATH)", "")
      .option("--strucpp", order->strucpp,
              "folder of the built compiler STruC++ (else by PLCHOST_STRUCPP, else by strucpp in PATH)", "")
      .option("--keep", order->keep,
              "leave the files between in this folder: a new or empty one, or one of an earlier --keep", "")
      .flag("--debug", order->debug, "a debug build: 'plcctl debug' can halt its tasks at each statement");
}

}  // namespace plchost
