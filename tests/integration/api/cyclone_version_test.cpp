// A libddsc that plchost-dds was not built with: the code that rests on its internals is left out, and the
// log says so.
#include <filesystem>
#include <fstream>
#include <sstream>

#include <dlfcn.h>
#include <gmock/gmock.h>

#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;
using testing::Not;

class LoadedCyclone : public testing::Test {
 protected:
  LoadedCyclone() {
    Dl_info library{};
    EXPECT_NE(::dladdr(::dlsym(RTLD_DEFAULT, "dds_create_domain"), &library), 0);
    library_ = std::filesystem::canonical(library.dli_fname);
    soname_ = std::filesystem::path(library.dli_fname).filename();
    std::filesystem::create_directory(folder_);
    host_.write_instance(0, "line1", InstanceState::running);
    host_.write_count(1);
  }
  /// The log of a server that loads the library of this machine under that name.
  std::string words_with(const std::string& name) {
    std::filesystem::copy_file(library_, folder_ + "/" + name);
    if (name != soname_) std::filesystem::create_symlink(name, folder_ + "/" + soname_);
    const std::string output = host_.run_directory() + "/server";
    ::setenv("LD_LIBRARY_PATH", folder_.c_str(),
             1);  // NOLINT(concurrency-mt-unsafe): nobody reads it meanwhile
    const Child server(PLCHOST_DDS_PROGRAM,
                       {"--host", "hosta", "--domain", std::to_string(domain_.number()), "--pool",
                        host_.pool_name(), "--run-directory", host_.run_directory(), "--interface", "lo"},
                       output);
    ::unsetenv("LD_LIBRARY_PATH");  // NOLINT(concurrency-mt-unsafe)
    const auto client = connect(domain_);
    const auto served = client->call({"hosta", plc_OPERATION_STOP, "line1", ""}, soon());
    EXPECT_TRUE(served) << served.error().describe();
    std::ostringstream text;
    text << std::ifstream(output + ".errors").rdbuf();
    return text.str();
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
  std::filesystem::path library_;
  std::string soname_;
  std::string folder_ = host_.run_directory() + "/libraries";
};

constexpr const char* kWords = "memory of clients that have ended is not given back";

TEST_F(LoadedCyclone, OfAnotherReleaseIsLeftAlone) {
  EXPECT_THAT(words_with("libddsc.so.0.10.99"), HasSubstr(kWords));
}

TEST_F(LoadedCyclone, WhoseReleaseIsNotToldIsLeftAlone) {
  EXPECT_THAT(words_with(soname_), HasSubstr(kWords));
}

TEST_F(LoadedCyclone, OfTheSameReleaseIsMended) {
  EXPECT_THAT(words_with(library_.filename()), Not(HasSubstr(kWords)));
}

}  // namespace
}  // namespace plchost
