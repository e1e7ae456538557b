#include "instances/adapters/translator.hpp"

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>

#include <gmock/gmock.h>

#include "tests/support/own_name.hpp"
#include "tests/unit/adapters/problem_texts.hpp"

namespace plchost {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// Folders that look like those of the compilers, and the environment of a build.
class ChosenCompiler : public testing::Test {
 protected:
  ChosenCompiler() {
    for (const char* const file :
         {"matiec/iec2c", "matiec/lib/ieclib.txt", "matiec/lib/C/iec_std_lib.h", "strucpp/dist/node/index.js",
          "strucpp/dist/node/cli.js", "strucpp/libs/none", "strucpp/src/runtime/include/iec_std_lib.hpp"}) {
      fs::create_directories(fs::path(path(file)).parent_path());
      std::ofstream(path(file)) << "\n";
    }
    fs::create_directories(path("bin"));
    fs::create_symlink(path("strucpp/dist/node/cli.js"), path("bin/strucpp"));
    for (Kept& kept : before_) {
      if (const char* const value = std::getenv(kept.name))  // NOLINT(concurrency-mt-unsafe)
        kept.value = value;
      ::unsetenv(kept.name);  // NOLINT(concurrency-mt-unsafe)
    }
  }
  ~ChosenCompiler() override {
    for (const Kept& kept : before_) {
      ::unsetenv(kept.name);                                        // NOLINT(concurrency-mt-unsafe)
      if (kept.value) ::setenv(kept.name, kept.value->c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
    }
    fs::remove_all(folder_);
  }
  [[nodiscard]] std::string path(const std::string& name) const { return folder_ + "/" + name; }
  static void set(const char* variable, const std::string& value) {
    ::setenv(variable, value.c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
  }
  // "matiec", and the remarks; or the problems.
  std::string chosen(const std::string& matiec = "", const std::string& strucpp = "") {
    BuildOrder order;
    order.matiec = matiec;
    order.strucpp = strucpp;
    BuildContext context(order);
    const auto translator = choose_translator(context);
    if (translator == nullptr) return iec::describe(context.report.problems.front());
    std::string text = translator->compiler() == iec::Compiler::matiec ? "matiec" : "strucpp";
    for (const std::string& remark : iec::texts(context.report.remarks)) text += "; " + remark;
    return text;
  }

 private:
  struct Kept {
    const char* name;
    std::optional<std::string> value = std::nullopt;
  };
  std::array<Kept, 3> before_{Kept{"PATH"}, Kept{"PLCHOST_MATIEC"}, Kept{"PLCHOST_STRUCPP"}};
  std::string folder_ = own_path("compilers");
};

TEST_F(ChosenCompiler, IsTheOneOfWhichTheFolderIsNamed) {
  set("PATH", path("matiec") + ":" + path("bin"));
  EXPECT_EQ(chosen(),
            "matiec; MATIEC and STruC++ are both there, and MATIEC is used; choose one by --compiler");
  EXPECT_EQ(chosen("", path("strucpp")), "strucpp");
  set("PLCHOST_STRUCPP", path("strucpp"));
  EXPECT_EQ(chosen(), "strucpp") << "a variable names it, too";
  EXPECT_EQ(chosen(path("matiec")), "matiec") << "an option counts more";
  set("PLCHOST_MATIEC", path("matiec"));
  EXPECT_THAT(chosen(), HasSubstr("are both there, and MATIEC is used"));
  EXPECT_EQ(chosen("", path("strucpp")), "strucpp");
  set("PLCHOST_STRUCPP", "/nowhere");
  EXPECT_THAT(chosen(), HasSubstr("there is no built STruC++"));
}

}  // namespace
}  // namespace plchost
