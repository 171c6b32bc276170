/* Keeps every entry of the library alive. */
void check_arms(void);
void check_inverse(void);
void check_motion(void);
void check_motion_of_seven(void);
void check_objects(void);
void check_clearance(void);
void check_tick(void);
#ifdef CONTROL
void check_control(void);
#endif

void *volatile entries[] = {
    (void *)check_arms,    (void *)check_inverse,
    (void *)check_motion,  (void *)check_motion_of_seven,
    (void *)check_objects, (void *)check_clearance,
    (void *)check_tick,
#ifdef CONTROL
    (void *)check_control,
#endif
};

int main(void) { return entries[0] == 0; }
