// The heap of Cyclone in which an entry is put in twice.
#include <array>
#include <cstddef>
#include <vector>

#include <dds/ddsrt/avl.h>
#include <dds/ddsrt/fibheap.h>
#include <gtest/gtest.h>

namespace plchost {
namespace {

struct TokenEntry {
  ddsrt_avl_node_t in_tree;
  ddsrt_fibheap_node_t in_heap;
  int time;
};

int compare_times(const void* one, const void* other) {
  return static_cast<const TokenEntry*>(one)->time - static_cast<const TokenEntry*>(other)->time;
}

TEST(TokenHeap, HasAnEntryOnceThatIsPutInTwice) {
  const ddsrt_fibheap_def_t kind{offsetof(TokenEntry, in_heap), compare_times};
  ddsrt_fibheap_t heap{};
  ddsrt_fibheap_init(&kind, &heap);
  std::array<TokenEntry, 17> entries{};
  for (int i = 0; i < 17; ++i) {
    entries[static_cast<std::size_t>(i)].time = i;
    ddsrt_fibheap_insert(&kind, &heap, &entries[static_cast<std::size_t>(i)]);
  }
  ASSERT_EQ(ddsrt_fibheap_extract_min(&kind, &heap), entries.data())
      << "the others are parents and children now";
  for (const std::size_t twice : {1U, 9U, 16U, 1U}) {  // the root of all, one between, and a leaf
    entries[twice].time += 100;
    ddsrt_fibheap_insert(&kind, &heap, &entries[twice]);
  }
  std::vector<int> times;
  while (times.size() <= entries.size()) {
    const auto* const first = static_cast<const TokenEntry*>(ddsrt_fibheap_extract_min(&kind, &heap));
    if (first == nullptr) break;
    times.push_back(first->time);
  }
  EXPECT_EQ(times, (std::vector{2, 3, 4, 5, 6, 7, 8, 10, 11, 12, 13, 14, 15, 109, 116, 201}));
}

}  // namespace
}  // namespace plchost
