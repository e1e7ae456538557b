// Names, files and lines of places in code, as its compilers wrote them down.
#include "instances/runtime/application/symbol_name.hpp"

#include <cstdint>
#include <string>
#include <vector>

#include <dlfcn.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/runtime/application/build_of.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::string called_from;

// The place that it returns to.
void note_caller() {
  const CodePlace place{.address = reinterpret_cast<std::uintptr_t>(__builtin_return_address(0)),
                        .returned_to = true};
  called_from = names_of(std::span(&place, 1)).front();
}

// The forms of the debug information that compilers have made since 1993, and none.
class CodeOf : public testing::TestWithParam<const char*> {
 protected:
  ~CodeOf() override { ::dlclose(object_); }
  template <class Function>
  Function* function(const char* name) {
    return reinterpret_cast<Function*>(::dlsym(object_, name));
  }
  [[nodiscard]] static std::string path() {
    return fmt::format("{}/debug_sample_{}.so", DEBUG_SAMPLES, GetParam());
  }
  template <class Function>
  [[nodiscard]] static std::string name_at(Function* code) {
    return name_of(reinterpret_cast<std::uintptr_t>(code));
  }

 private:
  void* object_ = ::dlopen(path().c_str(), RTLD_NOW | RTLD_LOCAL);
};

TEST_P(CodeOf, HasAName) {
  auto* const sut = function<int()>("own_line");
  ASSERT_NE(sut, nullptr) << ::dlerror();
  EXPECT_THAT(name_at(sut), StartsWith("own_line+0x0 in debug_sample_"));
}

TEST_P(CodeOf, HasItsLineIfItsCompilerWroteItDown) {
  auto* const own = function<int()>("own_line");
  auto* const text = function<int()>("line_of_structured_text");
  ASSERT_NE(text, nullptr);
  if (std::string(GetParam()) == "none") {
    EXPECT_THAT(name_at(own), Not(HasSubstr(" at ")));
    return;
  }
  // The line of the function's beginning is the one above.
  EXPECT_THAT(name_at(own), HasSubstr(fmt::format(" at debug_sample.c:{}", own() - 1)));
  EXPECT_THAT(name_at(text), HasSubstr(fmt::format(" at Mixer.st:{}", text() - 1)));
  EXPECT_THAT(name_at(text), Not(HasSubstr("plc/"))) << "folders are of the machine that has compiled it";
}

TEST_P(CodeOf, HasTheNameThatItsFileExportsWhenTheTimeIsOver) {
  auto* const own = function<int()>("own_line");
  const CodePlace place{.address = reinterpret_cast<std::uintptr_t>(own)};
  const std::string late = names_of(std::span(&place, 1), TimePoint::min()).front();
  EXPECT_THAT(late, StartsWith("own_line+0x0 in debug_sample_"));
  EXPECT_THAT(late, Not(HasSubstr(" at ")));
}

TEST_P(CodeOf, ThatCallsIsNamedByItsCall) {
  auto* const sut = function<int(void (*)())>("line_of_hidden");
  ASSERT_NE(sut, nullptr);
  const int line = sut(note_caller);
  EXPECT_THAT(called_from, StartsWith("hidden+0x"));
  if (std::string(GetParam()) != "none") {
    EXPECT_THAT(called_from, HasSubstr(fmt::format(" at debug_sample.c:{}", line)));
  }
}

TEST_P(CodeOf, TellsItsCompilerAndItsBuild) {
  EXPECT_THAT(build_of(path()),
              AllOf(HasSubstr("build ID "), testing::AnyOf(HasSubstr("GCC"), HasSubstr("clang"))));
}

INSTANTIATE_TEST_SUITE_P(Debug, CodeOf, testing::Values("none", "dwarf2", "dwarf3", "dwarf4", "dwarf5"),
                         [](const auto& test) { return std::string(test.param); });

TEST(SymbolName, OfNoCodeIsEmpty) {
  const std::vector<CodePlace> places{{.address = 0}, {.address = 8}, {.address = 1, .returned_to = true}};
  EXPECT_THAT(names_of(places), testing::Each(testing::IsEmpty()));
  EXPECT_EQ(build_of(std::string("/dev/null")), "");
}

}  // namespace
}  // namespace plchost
