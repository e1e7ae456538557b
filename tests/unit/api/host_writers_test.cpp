#include "api/dds/host_writers.hpp"

#include <gtest/gtest.h>

#include "api/dds/topics.hpp"

namespace plchost {
namespace {

TEST(HostWriters, AreNamedByEachPartitionThatHostsWriteInto) {
  for (const std::string host : {"cell", "cell.north", "c-1_2.s"}) {
    EXPECT_EQ(dds::host_in_partition(dds::status_partition(host)), host);
    EXPECT_EQ(dds::host_in_partition(dds::client_partition("0123456789abcdef", host)), host);
    EXPECT_EQ(dds::host_in_partition(dds::block_partition("other.host", host)), host);
    EXPECT_EQ(dds::host_in_partition(dds::name_partition(host)), host);
  }
  EXPECT_EQ(dds::host_in_partition(""), "");
  EXPECT_EQ(dds::host_in_partition("cell"), "");
}

}  // namespace
}  // namespace plchost
