# api/server/posts/post_intent.cpp: a count that has grown is taken for the post, although others post, too
# caught as: a post is lost or doubled
s/mark_\.store\(seen\.marked\(\) \? 0 : 1, std::memory_order_relaxed\);/mark_.store(static_cast<std::uint32_t>(seen.count()), std::memory_order_relaxed);/
s/event\.snapshot\(\)\.marked\(\) != \(mark_\.load\(std::memory_order_relaxed\) != 0\)/event.snapshot().count() <= mark_.load(std::memory_order_relaxed)/
