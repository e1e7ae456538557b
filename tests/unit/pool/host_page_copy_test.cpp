#include "shm/pages/host_page_copy.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "shm/guard/memory_guard.hpp"
#include "tests/support/interrupted_write.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class CopyOfAHostPage : public testing::Test {
 protected:
  CopyOfAHostPage() { write({"line1", "line2"}); }
  ~CopyOfAHostPage() override { HostPageWriter::remove(name_.get()); }

  void write(const std::vector<std::string>& instances) {
    for (std::uint32_t i = 0; i < instances.size(); ++i) {
      InstanceStatus instance;
      instance.name.assign(instances[i]);
      writer_->write_instance(i, instance);
    }
    HostStatus host;
    host.name.assign("controller");
    host.instance_count = static_cast<std::uint32_t>(instances.size());
    writer_->write_host(host);
  }
  [[nodiscard]] HostPageLayout& layout() const {
    return *reinterpret_cast<HostPageLayout*>(memory_.bytes().data());
  }
  static std::vector<std::string> names(const HostPageCopy& copy) {
    std::vector<std::string> names;
    for (const InstanceStatus* const instance : copy.instances()) names.emplace_back(instance->name.view());
    return names;
  }

  UniquePoolName name_;
  Result<HostPageWriter> writer_ = HostPageWriter::create(name_.get());
  MemoryFile memory_ =
      MemoryFile::open(host_page_name(name_.get()), sizeof(HostPageLayout), MemoryFile::Access::read_write)
          .value();
};

TEST_F(CopyOfAHostPage, KeepsWhatIsBeingWritten) {
  HostPageCopy sut(name_.get());
  ASSERT_TRUE(sut.refresh());
  interrupt_write(layout().instances[0]);
  EXPECT_FALSE(sut.refresh());
  EXPECT_THAT(names(sut), ElementsAre("line1", "line2"));
  interrupt_write(layout().host);
  EXPECT_FALSE(sut.refresh());
  ASSERT_NE(sut.host(), nullptr);
  EXPECT_EQ(sut.host()->name.view(), "controller");
  write({"line1"});
  EXPECT_TRUE(sut.refresh());
  EXPECT_THAT(names(sut), ElementsAre("line1")) << "the manager has said so";
}

TEST_F(CopyOfAHostPage, TellsNothingBeforeAllIsReadOnce) {
  interrupt_write(layout().instances[1]);
  HostPageCopy sut(name_.get());
  const auto waited = sut.wait(MonotonicClock::now());
  ASSERT_FALSE(waited);
  EXPECT_EQ(waited.error().code, ErrorCode::unavailable);
  EXPECT_EQ(sut.host(), nullptr);
  EXPECT_THAT(names(sut), IsEmpty());
  write({"line1", "line2"});
  EXPECT_TRUE(sut.wait(MonotonicClock::now()));
  EXPECT_THAT(names(sut), ElementsAre("line1", "line2"));
}

TEST_F(CopyOfAHostPage, CountsAnInstanceThatHasComeOnceItIsRead) {
  HostPageCopy sut(name_.get());
  ASSERT_TRUE(sut.refresh());
  write({"line1", "line2", "line3"});
  interrupt_write(layout().instances[2]);
  EXPECT_FALSE(sut.refresh());
  EXPECT_EQ(sut.host()->instance_count, 2U);
  EXPECT_THAT(names(sut), ElementsAre("line1", "line2"));
}

TEST_F(CopyOfAHostPage, CopiesAPartOnlyAfterItWasWritten) {
  HostPageCopy sut(name_.get());
  ASSERT_TRUE(sut.refresh());
  // As no writer does it: without another number.
  const auto bytes = std::as_writable_bytes(std::span(&layout().instances[0], 1));
  const auto name = std::ranges::search(bytes, std::as_bytes(std::span("line1", 5)));
  ASSERT_FALSE(name.empty());
  name[4] = std::byte{'7'};
  EXPECT_TRUE(sut.refresh());
  EXPECT_THAT(names(sut), ElementsAre("line1", "line2"));
  write({"line3", "line2"});
  EXPECT_TRUE(sut.refresh());
  EXPECT_THAT(names(sut), ElementsAre("line3", "line2"));
}

TEST_F(CopyOfAHostPage, OutlastsAPageThatIsCutShort) {
  MemoryGuard::watch_process();
  HostPageCopy sut(name_.get());
  ASSERT_TRUE(sut.refresh());
  std::filesystem::resize_file("/dev/shm/" + host_page_name(name_.get()), 0);
  EXPECT_FALSE(sut.refresh());
  EXPECT_FALSE(sut.refresh());
  EXPECT_THAT(names(sut), ElementsAre("line1", "line2"));
  EXPECT_TRUE(writer_->keep());
  EXPECT_TRUE(sut.refresh());
  EXPECT_THAT(names(sut), ElementsAre("line1", "line2"));
}

}  // namespace
}  // namespace plchost
