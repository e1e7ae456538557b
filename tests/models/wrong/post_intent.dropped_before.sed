# api/server/posts/post_intent.cpp: the intent is cleared before the new state counts
# caught as: a post is lost or doubled
s/if \(event\.snapshot\(\)\.marked\(\) != /const bool marked = event.snapshot().marked();\n  drop();\n  if (marked != /
