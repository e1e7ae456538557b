# api/server/posts/post_intent.cpp: the next server does not know of a post that was begun
# caught as: a post is lost or doubled
s/pending_\.store\(1, std::memory_order_release\);//
