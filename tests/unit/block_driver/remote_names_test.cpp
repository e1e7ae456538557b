#include "shm/block_driver/remote_names.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "shm/block_driver/node_directory.hpp"
#include "shm/files/pool_files.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

class RemoteNamesTest : public testing::Test {
 protected:
  ~RemoteNamesTest() override { NodeDirectory::remove(pool_.get()); }

  UniquePoolName pool_;
  RemoteNames sut_ = RemoteNames::open(pool_.get(), "blocks").value();
  RemoteNames reader_ = RemoteNames::open(pool_.get(), "blocks").value();
};

constexpr NodeAddress kPacker{.host = 2, .node = 7};

TEST_F(RemoteNamesTest, AreFoundByThoseWhoHadThemOpenBefore) {
  EXPECT_FALSE(reader_.find("packer@south"));
  sut_.write(std::vector{RemoteNode::of("south", "packer", kPacker),
                         RemoteNode::of("east", "packer", {.host = 3, .node = 1})});
  EXPECT_EQ(reader_.find("packer@south"), kPacker);
  EXPECT_EQ(reader_.find("packer@east"), (NodeAddress{.host = 3, .node = 1}));
  for (const char* nobody : {"packer", "packer@", "@south", "@", "", "packer@south@south", "south@packer"}) {
    EXPECT_FALSE(reader_.find(nobody)) << nobody;
  }
}

TEST_F(RemoteNamesTest, ThatAreGoneAreNotFound) {
  sut_.write(std::vector{RemoteNode::of("south", "packer", kPacker)});
  sut_.write({});
  EXPECT_FALSE(reader_.find("packer@south"));
}

TEST_F(RemoteNamesTest, AsManyAreFoundAsThereIsRoomFor) {
  std::vector<RemoteNode> nodes;
  for (std::size_t i = 0; i <= RemoteNames::kMost; ++i) {
    const NodeAddress address{.host = static_cast<std::uint16_t>(1 + i / kMaxNodes),
                              .node = static_cast<std::uint16_t>(1 + i % kMaxNodes)};
    nodes.push_back(RemoteNode::of("south", fmt::format("n{}", i), address));
  }
  sut_.write(nodes);
  EXPECT_EQ(reader_.find(fmt::format("n{}@south", RemoteNames::kMost - 1)),
            NodeAddress::from_number(nodes[RemoteNames::kMost - 1].address));
  EXPECT_FALSE(reader_.find(fmt::format("n{}@south", RemoteNames::kMost)));
}

TEST_F(RemoteNamesTest, WhatAStrangerWritesIsNobodysAddress) {
  const std::string name = pool_memory_name(pool_.get(), "blocks.hosts");
  const auto memory = MemoryFile::open(name, 1, MemoryFile::Access::read_write).value();
  sut_.write(std::vector{RemoteNode::of("south", "all", {.host = 2, .node = NodeAddress::kAllNodes}),
                         RemoteNode::of("south", "own", {.host = 0, .node = 3}),
                         RemoteNode::of("south", "far", {.host = 2, .node = kMaxNodes + 1})});
  for (const char* wrong : {"all@south", "own@south", "far@south"}) EXPECT_FALSE(reader_.find(wrong));
  for (const int fill : {0xff, 0x01, 0x00}) {
    std::ranges::fill(memory.bytes(), static_cast<std::byte>(fill));
    EXPECT_FALSE(reader_.find("packer@south"));
  }
  sut_.write(std::vector{RemoteNode::of("south", "packer", kPacker)});
  EXPECT_EQ(reader_.find("packer@south"), kPacker) << "it is mended by the next";
}

TEST_F(RemoteNamesTest, SomethingElseOfThatNameIsAnError) {
  (void)MemoryFile::replace(pool_memory_name(pool_.get(), "blocks.hosts"), 64).value();
  const auto refused = RemoteNames::open(pool_.get(), "blocks");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::corrupt);
}

}  // namespace
}  // namespace plchost
