"""The course: five lessons from take-off to the whole challenge, and what a class has done of them."""
