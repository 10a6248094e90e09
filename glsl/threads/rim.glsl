// The way of albedos between the two last rows of view angles. Twin: src/threads/rim.rs.

// The last row's angle to the horizon, of which 1 is a right angle: the largest view angle is 89.99 degrees.
const float LAST_TO_HORIZON = 0.01 / 90.0;

// The power of albedos that change evenly.
const float EVEN = 1.0;

// How far an albedo is on its way to the row above, where the view is at `row`, from the row below it.
float towards_row_above(float row, uint row_count, float rim_power) {
    float t = fract(row);
    if (rim_power == EVEN || row <= float(row_count - 2)) {
        return t;
    }
    float last = LAST_TO_HORIZON * float(row_count - 1);
    return (1.0 - pow(max(1.0 - t, last), rim_power)) / (1.0 - pow(last, rim_power));
}
