"""Many requests at once to one service: all are answered, and the same request with the same bytes."""

from concurrent.futures import ThreadPoolExecutor

PLAN = "/v1/trajectories"
LIMITS = {"velocity": 1, "acceleration": 2, "jerk": 10}
THREADS = 4


def bodies():
    """Twelve jerk-limited programs of three kinds, mixed with plans by other solvers."""
    for i in range(12):
        waypoints = [[0, 0], [1, 0.2 * (1 + i % 3)], [2, 0]]
        yield {
            "waypoints": waypoints,
            "method": "time_optimal_nlp",
            "options": {"stations": 20},
            "limits": LIMITS,
            "include": ["polynomial"],
        }
        if i % 2:
            yield {"waypoints": waypoints, "method": "minimum_jerk", "times": [0, 1, 2], "limits": {"velocity": 9}}
        else:
            limits = {k: LIMITS[k] for k in ("velocity", "acceleration")}
            yield {"waypoints": waypoints, "method": "toppra", "limits": limits}


def test_requests_at_once_get_the_same_bytes(service):
    asked = list(bodies())
    with ThreadPoolExecutor(THREADS) as pool:
        answers = list(pool.map(lambda body: service.post(PLAN, json=body), asked))
    assert [a.status_code for a in answers] == [200] * len(asked), [a.text[:500] for a in answers]
    for body, found in zip(asked, answers, strict=True):
        assert found.content == answers[asked.index(body)].content
    for body in asked[:6]:  # and as one alone gets them
        assert service.post(PLAN, json=body).content == answers[asked.index(body)].content
