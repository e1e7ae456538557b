# api/server/posts/post_intent.cpp: the next server does not wake the tasks of a post whose server was killed before its wake
# caught as: asleep for ever: nobody wakes the sleeper
s/event\.nudge\(\);//
