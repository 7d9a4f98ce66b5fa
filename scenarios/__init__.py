"""What is flown and how it is judged: scenarios, their files, and the referee."""
