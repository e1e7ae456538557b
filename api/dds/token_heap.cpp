// Cyclone 0.10.2 to 0.10.5 keeps the keys for a reader or writer that is not known yet. A heap has them by
// the time when they expire (find_or_create_pending_entity_match()). If they come once more, Cyclone puts the
// same entry in a second time. Then the heap is broken: the thread that takes the next one out crashes, or
// never ends. It happens when both sides begin anew before that reader or writer was announced, as after one
// of them stood still. The keys stay for 300 s, also when their participant goes. So an entry that is in the
// heap is taken out first.
#include "api/dds/token_heap.hpp"

#include <cstddef>

#include <dds/ddsrt/avl.h>
#include <dds/ddsrt/fibheap.h>

namespace plchost::dds {

void keep_tokens_once() noexcept {}

namespace {

using HeapNode = ddsrt_fibheap_node_t;

// Only addresses are compared: the memory of one that is new has never been written.
bool is_among(const HeapNode* roots, const HeapNode* wanted) {
  const HeapNode* node = roots;
  while (node != nullptr) {
    if (node == wanted) return true;
    if (node->children != nullptr) {
      node = node->children;
      continue;
    }
    // The nodes of one parent are a ring.
    while (node != nullptr && node->next == (node->parent == nullptr ? roots : node->parent->children)) {
      node = node->parent;
    }
    if (node != nullptr) node = node->next;
  }
  return false;
}

}  // namespace

}  // namespace plchost::dds

// The function of a program, or of a library that brings Cyclone, goes before that of Cyclone, which calls it
// by name and with the lock of the heap. It does all that Cyclone's does: a library has no other way to it.
extern "C" __attribute__((visibility("default"))) void ddsrt_fibheap_insert(const ddsrt_fibheap_def_t* kind,
                                                                            ddsrt_fibheap_t* heap,
                                                                            const void* entry) {
  // For the owner of the entry nothing in it changes.
  auto* const node = reinterpret_cast<ddsrt_fibheap_node_t*>(
      static_cast<std::byte*>(const_cast<void*>(entry)) + kind->offset);  // NOLINT(*-const-cast)
  // Such entries are in a tree as well. Those of Cyclone's busy heaps are not, and need no search.
  if (kind->offset == sizeof(ddsrt_avl_node_t) && plchost::dds::is_among(heap->roots, node)) {
    ddsrt_fibheap_delete(kind, heap, entry);  // compares the others only: this one has its new time already
  }
  *node = {};
  node->prev = node;
  node->next = node;
  ddsrt_fibheap_t alone{node};
  ddsrt_fibheap_merge(kind, heap, &alone);
}
