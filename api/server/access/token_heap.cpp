// Cyclone 0.10.2 to 0.10.5 keeps the keys for a reader or writer that is not known yet. A heap has them by
// the time when they expire (find_or_create_pending_entity_match()). If they come once more, Cyclone puts the
// same entry in a second time. Then the heap is broken: the thread that takes the next one out crashes, or
// never ends. It happens when both sides begin anew before that reader or writer was announced, as after one
// of them stood still. The keys stay for 300 s, also when their participant goes. So in plchost-dds an entry
// that is in the heap is taken out first.
#include <cstddef>

#include <dds/ddsrt/avl.h>
#include <dds/ddsrt/fibheap.h>
#include <dlfcn.h>

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

// A program's own function goes before that of a library that calls it by name, as Cyclone does, with the
// lock of the heap.
extern "C" __attribute__((visibility("default"))) void ddsrt_fibheap_insert(const ddsrt_fibheap_def_t* kind,
                                                                            ddsrt_fibheap_t* heap,
                                                                            const void* entry) {
  // Such entries are in a tree as well. Those of Cyclone's busy heaps are not, and need no search.
  if (kind->offset == sizeof(ddsrt_avl_node_t) &&
      is_among(heap->roots,
               reinterpret_cast<const HeapNode*>(static_cast<const std::byte*>(entry) + kind->offset))) {
    ddsrt_fibheap_delete(kind, heap, entry);  // compares the others only: this one has its new time already
  }
  using Insert = void (*)(const ddsrt_fibheap_def_t*, ddsrt_fibheap_t*, const void*);
  static const auto insert = reinterpret_cast<Insert>(::dlsym(RTLD_NEXT, "ddsrt_fibheap_insert"));
  insert(kind, heap, entry);
}
