# api/server/posts/post_intent.cpp: the source is told of its post before the post is made
# caught as: the record of the source is not of its last post
s/pending_\.store\(1, std::memory_order_release\);/pending_.store(1, std::memory_order_release);\n  kept.choose(next_.load(std::memory_order_relaxed));/
