# shm/base/counted_event.hpp: a post changes no mark, so nobody can tell whether it was made
# caught as: a post is lost or doubled
s/\(before \+ kOnePost\) \^ kMark/before + kOnePost/
