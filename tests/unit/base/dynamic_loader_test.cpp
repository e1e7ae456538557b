#include "shm/process/dynamic_loader.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <dlfcn.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <link.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/base/transient.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

// It belongs to the C library, so each machine has it, and no program needs it.
constexpr const char* kLibrary = "libBrokenLocale.so.1";

/// This process may use so little of something until the end of the scope.
class Limit {
 public:
  Limit(__rlimit_resource what, rlim_t value) : what_(what) {
    ::getrlimit(what, &before_);
    const rlimit now{.rlim_cur = value, .rlim_max = before_.rlim_max};
    ::setrlimit(what, &now);
  }
  ~Limit() { ::setrlimit(what_, &before_); }
  Limit(const Limit&) = delete;
  Limit& operator=(const Limit&) = delete;

 private:
  __rlimit_resource what_;
  rlimit before_{};
};

int transient_error_of(std::string_view text) {
  const Error error = error_of_loader(std::string(text));
  return is_transient(error) ? error.system_errno : 0;
}

TEST(LoaderText, TellsAShortageOfTheHost) {
  EXPECT_EQ(transient_error_of("a.so: cannot open shared object file: Too many open files"), EMFILE);
  EXPECT_EQ(transient_error_of("plc-instance: error while loading shared libraries: libm.so.6: cannot "
                               "open shared object file: Error 24"),
            EMFILE);
  EXPECT_EQ(transient_error_of("a.so: cannot create shared object descriptor: Cannot allocate memory"),
            ENOMEM);
  EXPECT_EQ(transient_error_of("libm.so.6: failed to map segment from shared object"), ENOMEM);
  EXPECT_EQ(transient_error_of("out of memory"), ENOMEM);
}

TEST(LoaderText, TellsThatTheSameFilesFailAgain) {
  for (const char* const text :
       {"", "a.so: cannot open shared object file: No such file or directory", "a.so: file too short",
        "a.so: cannot open shared object file: Permission denied", "a.so: invalid ELF header",
        "a.so: cannot open shared object file: Error 240", "a.so: undefined symbol: valve",
        "a.so: undefined symbol: x: Cannot allocate memory", "Cannot allocate memory.so: file too short",
        "a.so: cannot allocate memory in static TLS block"}) {
    EXPECT_EQ(transient_error_of(text), 0) << text;
  }
}

TEST(LoaderFolders, AreThoseInWhichThisProgramHasItsLibraries) {
  const std::vector<std::string> folders = library_folders();
  EXPECT_TRUE(std::ranges::any_of(folders, [](const std::string& folder) {
    return std::filesystem::exists(std::filesystem::path(folder) / "libc.so.6");
  })) << fmt::format("{}", fmt::join(folders, ", "));
}

// The loader's own words before a program runs, in which it knows fewer numbers than afterwards.
std::string loader_of_this_program_with(const std::function<void()>& limit) {
  std::array<int, 2> ends{};
  EXPECT_EQ(::pipe(ends.data()), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(ends[1], STDERR_FILENO);
    limit();
    ::execl("/proc/self/exe", "unit_base", "--gtest_list_tests", nullptr);
    ::_exit(1);
  }
  ::close(ends[1]);
  std::string text;
  std::array<char, 512> part{};
  for (ssize_t got = 0; (got = ::read(ends[0], part.data(), part.size())) > 0;)
    text.append(part.data(), static_cast<std::size_t>(got));
  ::close(ends[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), kExitNotLoaded) << text;
  return text.substr(0, text.find('\n'));
}

TEST(LoaderText, IsThatOfARealProgramWithoutDescriptors) {
  const std::string text = loader_of_this_program_with([] {
    constexpr rlimit kNone{.rlim_cur = 3, .rlim_max = 3};
    ::setrlimit(RLIMIT_NOFILE, &kNone);
    ::close_range(3, ~0U, 0);
  });
  EXPECT_EQ(transient_error_of(text), EMFILE) << text;
}

TEST(Loader, OpensALibrary) {
  const auto library = open_library(kLibrary, RTLD_NOW | RTLD_LOCAL);
  ASSERT_TRUE(library) << library.error().describe();
  EXPECT_EQ(::dlclose(*library), 0);
}

TEST(Loader, WithoutDescriptorsFailsForAMoment) {
  const Limit limit(RLIMIT_NOFILE, 3);
  const auto library = open_library(kLibrary, RTLD_NOW | RTLD_LOCAL);
  ASSERT_FALSE(library);
  EXPECT_TRUE(is_transient(library.error()));
  EXPECT_THAT(library.error().describe(),
              EndsWith("cannot open shared object file: Too many open files (EMFILE)"));
}

TEST(Loader, WithoutMemoryFailsForAMoment) {
#if defined(PLCHOST_ADDRESS_SANITIZER) || defined(PLCHOST_THREAD_SANITIZER)
  GTEST_SKIP() << "a sanitizer needs its memory";
#endif
  constexpr std::size_t kForTexts = 65536;
  std::free(std::malloc(kForTexts));  // NOLINT: stays in the heap
  const auto library = [] {
    const Limit limit(RLIMIT_AS, 1);
    return open_library(kLibrary, RTLD_NOW | RTLD_LOCAL);
  }();
  ASSERT_FALSE(library);
  EXPECT_TRUE(is_transient(library.error())) << library.error().describe();
}

TEST(Loader, WithoutTheLibraryFailsForGood) {
  for (const char* const file : {"/nonexistent.so", "/proc/self/cmdline"}) {
    const auto library = open_library(file, RTLD_NOW | RTLD_LOCAL);
    ASSERT_FALSE(library);
    EXPECT_FALSE(is_transient(library.error())) << library.error().describe();
    EXPECT_THAT(library.error().message, HasSubstr(file));
  }
}

/// A folder of a file system that is mounted noexec, with a library in it.
class FolderWithoutPrograms : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto library = open_library(kLibrary, RTLD_NOW | RTLD_LOCAL);
    ASSERT_TRUE(library) << library.error().describe();
    link_map* map = nullptr;
    ASSERT_EQ(::dlinfo(*library, RTLD_DI_LINKMAP, static_cast<void*>(&map)), 0);
    path_ = map->l_name;
    ASSERT_EQ(::dlclose(*library), 0);
    std::filesystem::create_directory(folder_);
  }
  ~FolderWithoutPrograms() override { std::filesystem::remove_all(folder_); }

  /// In a child that has it mounted.
  void expect_there(const std::function<bool()>& check) {
    constexpr int kNotAllowed = 77;
    const pid_t child = ::fork();
    if (child == 0) {
      if (::unshare(CLONE_NEWNS) != 0 || ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
          ::mount("none", folder_.c_str(), "tmpfs", MS_NOEXEC, nullptr) != 0) {
        ::_exit(kNotAllowed);
      }
      std::filesystem::copy_file(path_, folder_ / "a.so");
      ::_exit(check() ? 0 : 1);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    if (WIFEXITED(status) && WEXITSTATUS(status) == kNotAllowed) GTEST_SKIP() << "this user may not mount";
    EXPECT_EQ(status, 0);
  }

  std::string path_;
  std::filesystem::path folder_ = std::filesystem::temp_directory_path() / own_name("noexec");
};

// The loader has the same words for it as for a shortage of memory.
TEST_F(FolderWithoutPrograms, LetsALibraryFailForGood) {
  expect_there([&] {
    const auto refused = open_library(folder_ / "a.so", RTLD_NOW | RTLD_LOCAL);
    if (!refused) fmt::print("{}\n", refused.error().describe());
    return !refused && refused.error().code == ErrorCode::refused && !is_transient(refused.error());
  });
}

TEST_F(FolderWithoutPrograms, LetsAProgramThatNeedsTheLibraryFailForGood) {
  const std::string text =
      "x: error while loading shared libraries: a.so: failed to map segment from shared object";
  const std::vector<std::string> before{"/nonexistent", folder_};
  EXPECT_TRUE(is_transient(error_of_loader(text, before))) << "memory was short";
  expect_there([&] {
    const Error refused = error_of_loader(text, before);
    fmt::print("{}\n", refused.describe());
    return refused.code == ErrorCode::refused && !is_transient(refused) &&
           refused.message.find("noexec") != std::string::npos;
  });
}

}  // namespace
}  // namespace plchost
